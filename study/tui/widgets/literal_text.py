"""Text that is shown literally: square brackets are not read as Textual markup, so any text can be shown."""

from textual.widgets import Static


class LiteralText(Static):
    """A `Static` without markup, for texts from protocols, files and users."""

    def __init__(self, text: str = "", *, id: str | None = None, classes: str | None = None) -> None:
        super().__init__(text, id=id, classes=classes, markup=False)
