"""The experimenter's view inside the application. A separate process feeds it, so that no session is delayed."""

from __future__ import annotations

import threading
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from textual.app import App

from study.session.watching.requests import NoteAsked, Request

if TYPE_CHECKING:
    from study.tui.engine.watch_feed import WatchFeed
    from study.tui.watch.watch_screen import WatchScreen


class Watching:
    """One view at a time."""

    def __init__(self, app: App[Any]) -> None:
        self._app = app
        self._feed: WatchFeed | None = None
        self._screen: WatchScreen | None = None
        self._starting = False

    def open_here(self, path: str, ask: Callable[[Request], object]) -> None:
        """Open on the participant's own screen: confirmed by the session's name, and logged before it opens. The
        same key closes it."""
        if self._screen is not None and self._app.screen is self._screen:
            self.close()
            return
        from study.tui.screens.confirm_view import SHOWN_HERE, confirm_view

        def go_on() -> None:
            ask(NoteAsked("program", SHOWN_HERE))
            self.open(path, ask)

        confirm_view(self._app, Path(path).name, go_on)

    def confirm(self, path: str, ask: Callable[[Request], object]) -> None:
        """Open the view of a session at another screen, after confirmation."""
        from study.tui.screens.confirm_view import confirm_view

        confirm_view(self._app, Path(path).name, lambda: self.open(path, ask))

    def open(self, path: str, ask: Callable[[Request], object]) -> None:
        """Returns at once: the feed is started in a thread, because starting a process takes time."""
        if self._starting or (self._screen is not None and self._screen in self._app.screen_stack):
            return
        self._starting = True

        def start() -> None:
            from study.tui.engine.watch_feed import WatchFeed

            try:
                feed = WatchFeed(path)
            except OSError as problem:
                self._app.call_from_thread(self._report_refusal, problem)
            else:
                self._app.call_from_thread(self._show, feed, ask)

        threading.Thread(target=start, name="watch-start", daemon=True).start()

    def close(self) -> None:
        """Leave the view; the session continues."""
        screen, self._screen = self._screen, None
        while screen is not None and screen in self._app.screen_stack:
            self._app.pop_screen()
        self.end()

    def end(self) -> None:
        """End the reading process in a thread, because waiting would block the drawing."""
        feed, self._feed = self._feed, None
        if feed is not None:
            threading.Thread(target=feed.close, name="watch-end", daemon=True).start()

    def _report_refusal(self, problem: OSError) -> None:
        self._starting = False
        self._app.notify(f"The view cannot be opened: {problem.strerror or problem}.", severity="error", markup=False)

    def _show(self, feed: WatchFeed, ask: Callable[[Request], object]) -> None:
        from study.tui.watch.watch_screen import WatchScreen

        self.end()
        self._starting = False
        self._feed = feed
        self._screen = WatchScreen(feed, ask)
        self._app.push_screen(self._screen)
