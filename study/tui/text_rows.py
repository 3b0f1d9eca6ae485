"""Rows of words as lines with aligned columns. Cells that are too wide for the terminal are wrapped, never cut."""

from textwrap import wrap

Rows = tuple[tuple[str, ...], ...]

GAP = "  "
"""Between two columns."""
LEAST_CELLS = 12
"""Smallest width to which a column is narrowed; longer lines are wrapped by the terminal."""


def align_rows(rows: Rows, columns: int | None = None) -> tuple[str, ...]:
    """One line per row, or several where cells wrap. Columns of numbers below the header are right-aligned.

    columns: width of the terminal, to which the widest columns are narrowed; None = as wide as needed.
    """
    return tuple(line for lines in lines_of_rows(rows, columns) for line in lines)


def lines_of_rows(rows: Rows, columns: int | None = None) -> Rows:
    """Align rows as `align_rows` does, grouped by row."""
    if not rows:
        return ()
    count = max(map(len, rows))
    full = [(*row, *("",) * (count - len(row))) for row in rows]
    right = [_are_numbers([row[place] for row in full[1:]]) for place in range(count)]
    widths = _fit_widths([max(len(row[place]) for row in full) for place in range(count)], right, columns)
    return tuple(_lines(row, widths, right) for row in full)


def wrap_hanging(line: str, indent: int, columns: int | None) -> tuple[str, ...]:
    """One line wrapped to the terminal with a hanging indent of `indent`."""
    if columns is None or len(line) <= columns:
        return (line,)
    return tuple(wrap(line, columns, subsequent_indent=" " * indent, break_on_hyphens=False))


def _fit_widths(widths: list[int], right: list[bool], columns: int | None) -> list[int]:
    """Narrow the widest text columns first, down to `LEAST_CELLS`."""
    widths = list(widths)
    while columns is not None and (excess := sum(widths) + len(GAP) * (len(widths) - 1) - columns) > 0:
        words = [(width, place) for place, width in enumerate(widths) if width > LEAST_CELLS and not right[place]]
        if not words:
            break
        width, place = max(words)
        next_widest = max([LEAST_CELLS, *(other for other, where in words if where != place and other < width)])
        widths[place] = max(width - excess, next_widest)
    return widths


def _lines(row: tuple[str, ...], widths: list[int], right: list[bool]) -> tuple[str, ...]:
    cells = [wrap(text, width, break_on_hyphens=False) if len(text) > width else [text]
             for text, width in zip(row, widths, strict=True)]  # fmt: skip
    height = max(map(len, cells))
    return tuple(
        GAP.join(
            _cell(cell[line] if line < len(cell) else "", width, on_right)
            for cell, width, on_right in zip(cells, widths, right, strict=True)
        ).rstrip()
        for line in range(height)
    )


def _cell(text: str, width: int, right: bool) -> str:
    return text.rjust(width) if right else text.ljust(width)


def _are_numbers(cells: list[str]) -> bool:
    filled = [cell for cell in cells if cell not in ("", "–")]
    return bool(filled) and all(cell.lstrip("≥<−+ ")[:1].isdigit() for cell in filled)
