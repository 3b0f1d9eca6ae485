"""A read-only table: bold header, as wide as needed, to be placed in a scrollable container."""

from textual.content import Content
from textual.widgets import Static

from study.tui.text_rows import Rows, align_rows


class TextTable(Static):
    """Rows with aligned columns, as text."""

    DEFAULT_CSS = "TextTable { width: auto; height: auto; }"

    def __init__(self, rows: Rows, *, id: str | None = None) -> None:
        header, *body = align_rows(rows) or ("",)
        super().__init__(Content("\n").join([Content.styled(header, "bold"), *map(Content, body)]), id=id)
