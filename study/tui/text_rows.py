"""Layout of plain-text tables for terminal output: rows of cells as lines with aligned columns.

If the table is wider than the terminal, the widest text columns are narrowed and their cells wrapped; no text is cut.
"""

from textwrap import wrap

Rows = tuple[tuple[str, ...], ...]
"""Rows of cells; the first row is the header. Shorter rows are filled with empty cells."""

GAP = "  "
"""Blanks between two columns."""
MIN_COLUMN_WIDTH = 12
"""Least width, in characters, to which a column is narrowed; lines that are still too long are wrapped by the
terminal."""


def align_rows(rows: Rows, columns: int | None = None) -> tuple[str, ...]:
    """Lines of the table: one per row, or several where cells wrap. Columns of numbers are right-aligned.

    columns: width of the terminal in characters; None: no limit.
    """
    return tuple(line for lines in align_row_lines(rows, columns) for line in lines)


def align_row_lines(rows: Rows, columns: int | None = None) -> Rows:
    """Lines of the table, like `align_rows`, but as a tuple of lines per row."""
    if not rows:
        return ()
    column_count = max(map(len, rows))
    padded_rows = [(*row, *("",) * (column_count - len(row))) for row in rows]
    numeric = [_is_numeric_column([row[column] for row in padded_rows[1:]]) for column in range(column_count)]
    widths = _fit_widths(
        [max(len(row[column]) for row in padded_rows) for column in range(column_count)], numeric, columns
    )
    return tuple(_wrap_row(row, widths, numeric) for row in padded_rows)


def wrap_hanging(line: str, indent: int, columns: int | None) -> tuple[str, ...]:
    """Wrap a line to `columns` characters (None: no limit), with a hanging indent of `indent` blanks."""
    if columns is None or len(line) <= columns:
        return (line,)
    return tuple(wrap(line, columns, subsequent_indent=" " * indent, break_on_hyphens=False))


def _fit_widths(widths: list[int], numeric: list[bool], columns: int | None) -> list[int]:
    """Column widths that fit the terminal: the widest text columns are narrowed first, down to `MIN_COLUMN_WIDTH`.
    numeric: whether a column holds numbers, which is never narrowed."""
    widths = list(widths)
    while columns is not None and (excess := sum(widths) + len(GAP) * (len(widths) - 1) - columns) > 0:
        text_columns = [
            (width, column) for column, width in enumerate(widths) if width > MIN_COLUMN_WIDTH and not numeric[column]
        ]
        if not text_columns:
            break
        width, column = max(text_columns)
        next_widest = max(
            [MIN_COLUMN_WIDTH, *(narrower for narrower, index in text_columns if index != column and narrower < width)]
        )
        widths[column] = max(width - excess, next_widest)
    return widths


def _wrap_row(row: tuple[str, ...], widths: list[int], numeric: list[bool]) -> tuple[str, ...]:
    """Lines of one row, whose cells are wrapped to the column widths."""
    wrapped_cells = [wrap(text, width, break_on_hyphens=False) if len(text) > width else [text]
             for text, width in zip(row, widths, strict=True)]  # fmt: skip
    height = max(map(len, wrapped_cells))
    return tuple(
        GAP.join(
            _pad_cell(cell_lines[line_index] if line_index < len(cell_lines) else "", width, is_numeric)
            for cell_lines, width, is_numeric in zip(wrapped_cells, widths, numeric, strict=True)
        ).rstrip()
        for line_index in range(height)
    )


def _pad_cell(text: str, width: int, is_numeric: bool) -> str:
    return text.rjust(width) if is_numeric else text.ljust(width)


def _is_numeric_column(cells: list[str]) -> bool:
    """Whether all cells that are not empty or a dash begin with a number, and at least one does."""
    values = [cell for cell in cells if cell not in ("", "–")]
    return bool(values) and all(cell.lstrip("≥<−+ ")[:1].isdigit() for cell in values)
