"""`hapteq watch` as an application of its own: one screen, in a second terminal."""

from __future__ import annotations

from collections.abc import Callable

from textual.app import App

from study.session.requests import Request
from study.tui.screens.watch import WatchScreen, WatchSource


class WatchApp(App[None]):
    TITLE = "hapteq watch"
    ENABLE_COMMAND_PALETTE = True

    def __init__(self, source: WatchSource, ask: Callable[[Request], object]) -> None:
        super().__init__()
        self._source = source
        self._ask = ask
        self.animation_level = "none"

    def on_mount(self) -> None:
        self.push_screen(WatchScreen(self._source, self._ask))

    def on_watch_screen_left(self) -> None:
        self.exit()
