"""Open and close the experimenter's view inside the application that runs or lists sessions (`study.tui.app.app`).

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


class WatchController:
    """Controller of the experimenter's view; at most one view is open at a time. Arguments of its methods:
    session_folder, the path of the session's folder; send_request, which sends a request of the view to the session."""

    def __init__(self, app: App[Any]) -> None:
        self._app = app
        self._feed: WatchFeed | None = None
        self._screen: WatchScreen | None = None
        self._is_starting = False

    def toggle_view(self, session_folder: str, send_request: Callable[[Request], object]) -> None:
        """Close the view if it is on top. Otherwise open it on the screen of the running session, after the user has
        typed the name of the session as confirmation; a note for the log, that it was shown, is sent before."""
        if self._screen is not None and self._app.screen is self._screen:
            self.close()
            return
        from study.tui.screens.confirm_view import VIEW_SHOWN_NOTE, confirm_view

        def open_confirmed() -> None:
            send_request(NoteAsked("program", VIEW_SHOWN_NOTE))
            self.open_view(session_folder, send_request)

        confirm_view(self._app, Path(session_folder).name, open_confirmed)

    def open_after_confirmation(self, session_folder: str, send_request: Callable[[Request], object]) -> None:
        """Open the view of a session that another program runs, after the same confirmation; nothing is logged."""
        from study.tui.screens.confirm_view import confirm_view

        confirm_view(self._app, Path(session_folder).name, lambda: self.open_view(session_folder, send_request))

    def open_view(self, session_folder: str, send_request: Callable[[Request], object]) -> None:
        """Open the view without confirmation, unless one is open or being opened. Returns before it is open: a thread
        starts the reading process, because that takes time. An OSError is shown as a notification."""
        if self._is_starting or (self._screen is not None and self._screen in self._app.screen_stack):
            return
        self._is_starting = True

        def start_feed() -> None:
            from study.tui.engine.watch_feed import WatchFeed

            try:
                feed = WatchFeed(session_folder)
            except OSError as error:
                self._app.call_from_thread(self._report_start_failure, error)
            else:
                self._app.call_from_thread(self._show_view, feed, send_request)

        threading.Thread(target=start_feed, name="watch-start", daemon=True).start()

    def close(self) -> None:
        """Close the view with all screens above it, and end the reading process; the session continues."""
        screen, self._screen = self._screen, None
        while screen is not None and screen in self._app.screen_stack:
            self._app.pop_screen()
        self.end_feed()

    def end_feed(self) -> None:
        """End the reading process, if there is one, in a thread, because waiting for it would block the event loop."""
        feed, self._feed = self._feed, None
        if feed is not None:
            threading.Thread(target=feed.close, name="watch-end", daemon=True).start()

    def _report_start_failure(self, error: OSError) -> None:
        self._is_starting = False
        self._app.notify(f"The view cannot be opened: {error.strerror or error}.", severity="error", markup=False)

    def _show_view(self, feed: WatchFeed, send_request: Callable[[Request], object]) -> None:
        """Show the view of a reading process that has started, and end the previous one."""
        from study.tui.watch.watch_screen import WatchScreen

        self.end_feed()
        self._is_starting = False
        self._feed = feed
        self._screen = WatchScreen(feed, send_request)
        self._app.push_screen(self._screen)
