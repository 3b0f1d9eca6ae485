"""Containers of the participant's screens (`study.tui.screens`), with lines of readable width: a framed card for short
text, a scrolling sheet for long text."""

from textual.containers import Vertical, VerticalScroll


class Card(Vertical):
    """Framed box with a title, as high as its content, at most as the screen. The screen's `align` style places it."""

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
    """Column that scrolls vertically, for text that is longer than the screen."""

    DEFAULT_CSS = """
    Sheet {
        width: 100%; max-width: 100; height: 1fr; padding: 0 2;
        scrollbar-size-vertical: 1; scrollbar-color: $foreground 40%;
    }
    Sheet > .title { text-style: bold; color: $text-primary; margin-top: 1; }
    Sheet > .strong { text-style: bold; }
    Sheet > .gap { margin-top: 1; }
    """
