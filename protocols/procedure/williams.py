"""Orders that balance position and first-order carry-over.

Source: E. J. Williams, Experimental designs balanced for the estimation of residual effects of treatments,
Australian Journal of Scientific Research A 2 (1949), 149-168.
"""


def williams_rows(conditions: int) -> tuple[tuple[int, ...], ...]:
    """Rows of places 0 … conditions - 1, one row per participant.

    Over all rows each condition stands in each position equally often, and each follows each other equally often:
    once in the `conditions` rows of an even number, twice in the 2 x `conditions` rows of an odd one.
    """
    if conditions < 1:
        raise ValueError(f"a Williams design needs one condition at the least, not {conditions}")
    # 0, 1, n-1, 2, n-2, …: no two neighbours are the same distance apart.
    first = [0]
    for place in range(1, conditions):
        first.append((place + 1) // 2 if place % 2 else conditions - place // 2)
    rows = tuple(tuple((place + shift) % conditions for place in first) for shift in range(conditions))
    if conditions % 2 == 0:
        return rows
    return rows + tuple(row[::-1] for row in rows)
