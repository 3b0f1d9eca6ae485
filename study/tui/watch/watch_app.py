"""Application of `hapteq watch` (`study.cli.watch`): the experimenter's view of a running session in a second terminal.

The view itself is `watch_screen.WatchScreen`; this application adds themes, the queue of user input, and the exit on
signals or without a terminal.
"""

from __future__ import annotations

import time
from collections.abc import Callable

from textual.app import App
from textual.binding import Binding
from textual.events import Event

from study.session.watching.requests import Request
from study.tui.exit_handlers import install_exit_handlers
from study.tui.keys.input_queue import InputQueue
from study.tui.keys.key_names import format_key_name
from study.tui.themes import DARK, NEXT_THEME, register_themes
from study.tui.watch.watch_screen import WatchScreen
from study.tui.watch.watch_source import WatchSource


class WatchApp(App[None]):
    """Application that shows the experimenter's view and ends with it."""

    TITLE = "hapteq watch"

    def __init__(
        self,
        source: WatchSource,
        send_request: Callable[[Request], object],
        theme: str = DARK.name,
        clock_s: Callable[[], float] = time.monotonic,
    ) -> None:
        """source: provides the views of the session. send_request: sends a request to the session; raises StudyError
        where that fails. theme: name of the first theme. clock_s: monotonic time (s), for the repetition of alarms."""
        super().__init__()
        self._source = source
        self._send_request = send_request
        self._clock_s = clock_s
        self._keys = InputQueue(self, super().on_event)
        self.animation_level = "none"
        register_themes(self, theme)

    async def on_event(self, event: Event) -> None:
        await self._keys.handle_event(event)

    def get_key_display(self, binding: Binding) -> str:
        return format_key_name(super().get_key_display(binding))

    def on_mount(self) -> None:
        install_exit_handlers(self, self.exit)
        self.push_screen(WatchScreen(self._source, self._send_request, self._clock_s))

    def on_watch_screen_closed(self) -> None:
        self.exit()

    def action_next_theme(self) -> None:
        self.theme = NEXT_THEME[self.theme]
