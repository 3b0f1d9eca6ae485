"""Table widget as text: bold header, aligned columns, as wide as its content; the container must scroll."""

from textual.content import Content
from textual.widgets import Static

from study.tui.text_rows import Rows, align_rows


class TextTable(Static):
    """Table of text with a bold header; its rows do not change."""

    DEFAULT_CSS = "TextTable { width: auto; height: auto; }"

    def __init__(self, rows: Rows) -> None:
        """rows: rows of cells, of which the first is the header; without rows, an empty line is shown."""
        header, *body = align_rows(rows) or ("",)
        super().__init__(Content("\n").join([Content.styled(header, "bold"), *map(Content, body)]))
