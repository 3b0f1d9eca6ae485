"""Opens and closes the experimenter's view inside the application that runs or lists sessions.

A separate process (`WatchFeed`) reads the log for the view, so that reading never delays a running session.
"""

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
    """Opens and closes the experimenter's view of a session; at most one view is open at a time. ask: passes a request
    on to the session."""

    def __init__(self, app: App[Any]) -> None:
        self._app = app
        self._feed: WatchFeed | None = None
        self._screen: WatchScreen | None = None
        self._starting = False

    def open_here(self, path: str, ask: Callable[[Request], object]) -> None:
        """Open the view on the participant's own screen, after confirmation by the session's name; a note in the log
        says so before the view opens. If the view is already on top, close it."""
        if self._screen is not None and self._app.screen is self._screen:
            self.close()
            return
        from study.tui.screens.confirm_view import VIEW_SHOWN_NOTE, confirm_view

        def open_confirmed() -> None:
            ask(NoteAsked("program", VIEW_SHOWN_NOTE))
            self.open(path, ask)

        confirm_view(self._app, Path(path).name, open_confirmed)

    def confirm(self, path: str, ask: Callable[[Request], object]) -> None:
        """Open the view of a session that runs elsewhere, after confirmation by its name; nothing is logged."""
        from study.tui.screens.confirm_view import confirm_view

        confirm_view(self._app, Path(path).name, lambda: self.open(path, ask))

    def open(self, path: str, ask: Callable[[Request], object]) -> None:
        """Open the view without confirmation, unless it is open or being opened. Returns at once: the process is
        started in a thread, because that takes time. A failure is shown as a notification."""
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
        """Close the view and end the process that reads for it; the session continues."""
        screen, self._screen = self._screen, None
        while screen is not None and screen in self._app.screen_stack:
            self._app.pop_screen()
        self.end()

    def end(self) -> None:
        """End the process that reads for the view, in a thread, because waiting for it would block the screen."""
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
