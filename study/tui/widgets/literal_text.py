"""Text shown literally: square brackets are not markup."""

from textual.widgets import Static


class LiteralText(Static):
    """A `Static` without markup."""

    def __init__(self, text: str = "", *, id: str | None = None, classes: str | None = None) -> None:
        super().__init__(text, id=id, classes=classes, markup=False)
