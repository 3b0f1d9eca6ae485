"""Dismiss a screen with its reply only once, even if two keys that dismiss it arrive together."""

from __future__ import annotations

from typing import TypeVar

from textual.screen import Screen

Reply = TypeVar("Reply")


def dismiss_screen(screen: Screen[Reply], reply: Reply) -> None:
    """Dismiss the screen if it is on top of the screen stack; otherwise do nothing. Of two keys that arrive together,
    both are handled by the same screen: a second `Screen.dismiss` would remove the screen below it, or end the
    program."""
    if screen.is_active:
        screen.dismiss(reply)
