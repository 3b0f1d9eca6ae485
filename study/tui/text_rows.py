"""Layout of a plain-text table: rows of cells as lines with aligned columns, for terminal output.

If the table is wider than the terminal, the widest text columns are narrowed and their cells wrapped; no text is cut.
"""

from textwrap import wrap

Rows = tuple[tuple[str, ...], ...]
"""Rows of cells; the first row is the header. Shorter rows are filled with empty cells."""

GAP = "  "
"""Blanks between two columns."""
LEAST_CELLS = 12
"""Least width, in characters, to which a column is narrowed; lines that are still too long are wrapped by the
terminal."""


def align_rows(rows: Rows, columns: int | None = None) -> tuple[str, ...]:
    """Lines of the table: one per row, or several where cells wrap. Columns of numbers are right-aligned.

    columns: width of the terminal in characters; None: no limit.
    """
    return tuple(line for lines in lines_of_rows(rows, columns) for line in lines)


def lines_of_rows(rows: Rows, columns: int | None = None) -> Rows:
    """Lines of the table as by `align_rows`, grouped by row: (rows)(lines of that row)."""
    if not rows:
        return ()
    count = max(map(len, rows))
    full = [(*row, *("",) * (count - len(row))) for row in rows]
    right = [_are_numbers([row[place] for row in full[1:]]) for place in range(count)]
    widths = _fit_widths([max(len(row[place]) for row in full) for place in range(count)], right, columns)
    return tuple(_lines(row, widths, right) for row in full)


def wrap_hanging(line: str, indent: int, columns: int | None) -> tuple[str, ...]:
    """A line wrapped to `columns` characters, with `indent` blanks before every further line; None: not wrapped."""
    if columns is None or len(line) <= columns:
        return (line,)
    return tuple(wrap(line, columns, subsequent_indent=" " * indent, break_on_hyphens=False))


def _fit_widths(widths: list[int], right: list[bool], columns: int | None) -> list[int]:
    """Column widths that fit the terminal: the widest text columns are narrowed first, down to `LEAST_CELLS`. right:
    whether a column holds numbers, which is never narrowed."""
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
    """Lines of one row, whose cells are wrapped to the column widths."""
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
    """Whether all cells that are not empty or a dash begin with a number, and at least one does."""
    filled = [cell for cell in cells if cell not in ("", "–")]
    return bool(filled) and all(cell.lstrip("≥<−+ ")[:1].isdigit() for cell in filled)
