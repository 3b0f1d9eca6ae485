"""Read-only table as text: bold header, aligned columns, as wide as its content; the container must scroll."""

from textual.content import Content
from textual.widgets import Static

from study.tui.text_rows import Rows, align_rows


class TextTable(Static):
    """A table of text. rows: the first is the header; no rows give an empty line."""

    DEFAULT_CSS = "TextTable { width: auto; height: auto; }"

    def __init__(self, rows: Rows, *, id: str | None = None) -> None:
        header, *body = align_rows(rows) or ("",)
        super().__init__(Content("\n").join([Content.styled(header, "bold"), *map(Content, body)]), id=id)
