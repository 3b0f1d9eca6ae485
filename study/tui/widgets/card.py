"""Frames for text: a card for a little, a sheet that scrolls for more. Limited to a readable width."""

from textual.containers import Vertical, VerticalScroll


class Card(Vertical):
    """Centred by the screen's alignment."""

    DEFAULT_CSS = """
    Card {
        width: 74; max-width: 95%; height: auto; max-height: 100%; border: round $primary; padding: 1 2;
        background: $surface;
    }
    Card > .strong { text-style: bold; }
    Card > .gap { margin-top: 1; }
    """

    def __init__(self, title: str) -> None:
        super().__init__()
        self.border_title = title


class Sheet(VerticalScroll):
    """Text that scrolls, for more than a screenful."""

    DEFAULT_CSS = """
    Sheet {
        width: 100%; max-width: 100; height: 1fr; padding: 0 2;
        scrollbar-size-vertical: 1; scrollbar-color: $foreground 40%;
    }
    Sheet > .title { text-style: bold; color: $text-primary; margin-top: 1; }
    Sheet > .strong { text-style: bold; }
    Sheet > .gap { margin-top: 1; }
    """
