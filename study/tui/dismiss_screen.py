"""Dismiss a screen with its reply, exactly once."""

from __future__ import annotations

from typing import TypeVar

from textual.screen import Screen

Reply = TypeVar("Reply")


def dismiss_screen(screen: Screen[Reply], reply: Reply) -> None:
    """Dismiss the screen if it is on top. Of two keys that arrive together, both are handled by the first key's
    screen: with the second, Textual would remove the screen below, or end the program."""
    if screen.is_active:
        screen.dismiss(reply)
