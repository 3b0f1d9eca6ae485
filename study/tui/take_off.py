"""The one way in which a screen leaves: with its reply, and once."""

from __future__ import annotations

from typing import TypeVar

from textual.screen import Screen

Reply = TypeVar("Reply")


def take_off(screen: Screen[Reply], reply: Reply) -> None:
    """Nothing, where it is not the screen on top. Two keys that arrive together are both handed to the screen of the
    first: with the second, Textual would pop whatever lies below, or end the program where nothing does."""
    if screen.is_active:
        screen.dismiss(reply)
