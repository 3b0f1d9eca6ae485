"""Rows of words as lines with aligned columns."""

Rows = tuple[tuple[str, ...], ...]

GAP = "  "


def aligned(rows: Rows) -> tuple[str, ...]:
    """One line per row. Columns that hold numbers below the header stand on the right."""
    if not rows:
        return ()
    columns = max(map(len, rows))
    full = [(*row, *("",) * (columns - len(row))) for row in rows]
    widths = [max(len(row[column]) for row in full) for column in range(columns)]
    right = [_are_numbers([row[column] for row in full[1:]]) for column in range(columns)]
    return tuple(GAP.join(_cell(row[c], widths[c], right[c]) for c in range(columns)).rstrip() for row in full)


def _cell(text: str, width: int, right: bool) -> str:
    return text.rjust(width) if right else text.ljust(width)


def _are_numbers(cells: list[str]) -> bool:
    filled = [cell for cell in cells if cell not in ("", "–")]
    return bool(filled) and all(cell.lstrip("≥<−+ ")[:1].isdigit() for cell in filled)
