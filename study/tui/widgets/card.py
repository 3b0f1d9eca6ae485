"""Containers of the screens (`study.tui.screens`), with lines of readable width (74 and 100 columns, chosen): a framed
card for short text, a scrolling sheet for long text."""

from textual.containers import Vertical, VerticalScroll


class Card(Vertical):
    """Framed box with a title, as high as its content and at most as its container; then it scrolls. CSS classes of
    its widgets: `strong` (bold), `gap` (an empty line above)."""

    DEFAULT_CSS = """
    Card {
        width: 74; max-width: 95%; height: auto; max-height: 100%; border: round $primary; padding: 1 2;
        background: $surface; overflow-y: auto; scrollbar-size-vertical: 1;
    }
    Card > .strong { text-style: bold; }
    Card > .gap { margin-top: 1; }
    """

    def __init__(self, title: str) -> None:
        """title: text in the upper edge of the frame."""
        super().__init__()
        self.border_title = title


class Sheet(VerticalScroll):
    """Column that scrolls vertically, for text that is longer than the screen. CSS classes of its widgets: `title`,
    `strong` (bold), `gap` (an empty line above)."""

    DEFAULT_CSS = """
    Sheet {
        width: 100%; max-width: 100; height: 1fr; padding: 0 2;
        scrollbar-size-vertical: 1; scrollbar-color: $foreground 40%;
    }
    Sheet > .title { text-style: bold; color: $text-primary; margin-top: 1; }
    Sheet > .strong { text-style: bold; }
    Sheet > .gap { margin-top: 1; }
    """
