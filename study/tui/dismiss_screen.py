"""Dismiss a screen with its reply exactly once, even if two keys that dismiss it arrive together."""

from __future__ import annotations

from typing import TypeVar

from textual.screen import Screen

Reply = TypeVar("Reply")
"""Type of the value that a screen returns."""


def dismiss_screen(screen: Screen[Reply], reply: Reply) -> None:
    """Dismiss the screen if it is on top; otherwise do nothing. Two keys that arrive together are both handled by the
    same screen. If that screen were dismissed again for the second key, Textual would remove the screen below it, or
    end the program."""
    if screen.is_active:
        screen.dismiss(reply)
