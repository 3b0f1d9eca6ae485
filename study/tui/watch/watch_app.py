"""`hapteq watch` as an application of its own: one screen, in a second terminal."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import ClassVar

from textual.app import App
from textual.binding import Binding, BindingType
from textual.events import Event

from study.session.watching.requests import Request
from study.tui.departure import leave_with_the_terminal
from study.tui.keys.key_names import key_name
from study.tui.keys.keys_in_order import KeysInOrder
from study.tui.themes import DARK, NEXT, register_themes
from study.tui.watch.watch_screen import WatchScreen
from study.tui.watch.watch_source import WatchSource


class WatchApp(App[None]):
    """The experimenter's view in a terminal of its own. F9 changes the colours; the other keys are the screen's."""

    TITLE = "hapteq watch"
    BINDINGS: ClassVar[list[BindingType]] = [Binding("t", "next_theme", "Theme", show=False)]

    def __init__(
        self,
        source: WatchSource,
        ask: Callable[[Request], object],
        theme: str = DARK.name,
        clock_s: Callable[[], float] = time.monotonic,
    ) -> None:
        """ask: hands a request to the session; raises StudyError where it cannot. clock_s: time of alarms, seconds."""
        super().__init__()
        self._source = source
        self._ask = ask
        self._clock_s = clock_s
        self._keys = KeysInOrder(self, super().on_event)
        self.animation_level = "none"
        register_themes(self, theme)

    async def on_event(self, event: Event) -> None:
        await self._keys.take(event)

    def get_key_display(self, binding: Binding) -> str:
        return key_name(super().get_key_display(binding))

    def on_mount(self) -> None:
        leave_with_the_terminal(self, self.exit)
        self.push_screen(WatchScreen(self._source, self._ask, self._clock_s))

    def on_watch_screen_left(self) -> None:
        self.exit()

    def action_next_theme(self) -> None:
        self.theme = NEXT[self.theme]
