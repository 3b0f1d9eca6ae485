"""Text widget that shows any text literally: square brackets are not interpreted as Textual markup. Used by the
participant's screens (`study.tui.screens`)."""

from textual.widgets import Static


class LiteralText(Static):
    """A `Static` without markup, for texts from protocols, files and users. id and classes: as for `Static`."""

    def __init__(self, text: str = "", *, id: str | None = None, classes: str | None = None) -> None:
        super().__init__(text, id=id, classes=classes, markup=False)
