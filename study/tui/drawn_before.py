"""Textual 8.2 keeps what the last 1024 widgets looked like, also those of screens that are gone."""

from textual._styles_cache import StylesCache


def forget_drawn_before() -> None:
    """To be called where screens come and go. Its lookup of two colours is cached by the whole widget's drawing, by
    mistake; searching all of these for garbage held the event loop up for longer with every trial, and past the
    half second after which a screen counts as dead."""
    StylesCache.get_inner_outer.cache_clear()
