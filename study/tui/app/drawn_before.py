"""What Textual 8.2 keeps of widgets that are gone. Searching it for garbage holds the event loop up: for longer with
every trial, and in the end past the half second after which a screen counts as dead."""

from typing import Any

from textual._styles_cache import StylesCache
from textual.app import App
from textual.widgets import Footer


def forget_drawn_before(app: App[Any]) -> None:
    """To be called where screens come and go."""
    # By mistake, a lookup of two colours is cached by the whole drawing of a widget: the last 1024 of them.
    StylesCache.get_inner_outer.cache_clear()
    for screen in app.screen_stack:
        for footer in screen.query(Footer):
            # A footer that is written anew goes on watching for its old keys, until what they follow changes.
            footer.mutate_reactive(Footer.compact)
