"""Text that is shown as it is: square brackets in it are no markup."""

from textual.widgets import Static


class Said(Static):
    def __init__(self, text: str = "", *, id: str | None = None, classes: str | None = None) -> None:
        super().__init__(text, id=id, classes=classes, markup=False)
