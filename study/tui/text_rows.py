"""Lay out plain-text tables for terminal output: rows of cells as lines with aligned columns.

If the table is wider than the terminal, the widest text columns are narrowed and their cells wrapped; no text is cut.
"""

from textwrap import wrap

Rows = tuple[tuple[str, ...], ...]
"""Rows of cells, of which the first is the header; a shorter row lacks its last cells. Also used for lines per row."""

COLUMN_GAP = "  "
"""Text between two columns."""
MIN_COLUMN_WIDTH = 12
"""Least width (characters) to which a column is narrowed. Chosen; the terminal wraps lines that are still too long."""


def align_rows(rows: Rows, terminal_width: int | None = None) -> tuple[str, ...]:
    """Lay out a table as lines: one per row, or several where cells are wrapped; none without rows. Columns of numbers
    are right-aligned. terminal_width: in characters; None: no limit."""
    return tuple(line for lines in align_row_lines(rows, terminal_width) for line in lines)


def align_row_lines(rows: Rows, terminal_width: int | None = None) -> Rows:
    """Lay out a table like `align_rows`, but return a tuple of lines for each row."""
    if not rows:
        return ()
    column_count = max(map(len, rows))
    padded_rows = [(*row, *("",) * (column_count - len(row))) for row in rows]
    are_numeric = [_is_numeric_column([row[column] for row in padded_rows[1:]]) for column in range(column_count)]
    widths = _fit_widths(
        [max(len(row[column]) for row in padded_rows) for column in range(column_count)], are_numeric, terminal_width
    )
    return tuple(_wrap_row(row, widths, are_numeric) for row in padded_rows)


def wrap_hanging(line: str, indent: int, terminal_width: int | None) -> tuple[str, ...]:
    """Wrap a line to `terminal_width` characters (None: no limit), with a hanging indent of `indent` blanks."""
    if terminal_width is None or len(line) <= terminal_width:
        return (line,)
    return tuple(wrap(line, terminal_width, subsequent_indent=" " * indent, break_on_hyphens=False))


def _fit_widths(widths: list[int], are_numeric: list[bool], terminal_width: int | None) -> list[int]:
    """Reduce column widths (characters) until the table fits the terminal: the widest text column first, down to
    `MIN_COLUMN_WIDTH`; columns of numbers never. are_numeric: per column, whether it holds numbers."""
    widths = list(widths)
    while (
        terminal_width is not None
        and (excess_width := sum(widths) + len(COLUMN_GAP) * (len(widths) - 1) - terminal_width) > 0
    ):
        text_columns = [
            (width, column)
            for column, width in enumerate(widths)
            if width > MIN_COLUMN_WIDTH and not are_numeric[column]
        ]
        if not text_columns:
            break
        width, column = max(text_columns)
        next_widest = max(
            [MIN_COLUMN_WIDTH, *(narrower for narrower, index in text_columns if index != column and narrower < width)]
        )
        widths[column] = max(width - excess_width, next_widest)
    return widths


def _wrap_row(row: tuple[str, ...], widths: list[int], are_numeric: list[bool]) -> tuple[str, ...]:
    """Lay out one row: wrap its cells to the column widths, and join them line by line."""
    wrapped_cells = [wrap(text, width, break_on_hyphens=False) if len(text) > width else [text]
             for text, width in zip(row, widths, strict=True)]  # fmt: skip
    height = max(map(len, wrapped_cells))
    return tuple(
        COLUMN_GAP.join(
            _pad_cell(cell_lines[line_index] if line_index < len(cell_lines) else "", width, is_numeric)
            for cell_lines, width, is_numeric in zip(wrapped_cells, widths, are_numeric, strict=True)
        ).rstrip()
        for line_index in range(height)
    )


def _pad_cell(text: str, width: int, is_numeric: bool) -> str:
    """Pad a text with blanks to `width`: on the left for numbers, otherwise on the right."""
    return text.rjust(width) if is_numeric else text.ljust(width)


def _is_numeric_column(cells: list[str]) -> bool:
    """Whether there are cells that are neither empty nor a dash, and they begin with a digit after any signs."""
    values = [cell for cell in cells if cell not in ("", "–")]
    return bool(values) and all(cell.lstrip("≥<−+ ")[:1].isdigit() for cell in values)
