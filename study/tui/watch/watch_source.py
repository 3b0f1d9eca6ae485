"""Interface from which the experimenter's screen (`hapteq watch`) gets its views of a running session.

`watch_screen` and `watch_app` depend on this protocol alone, so that tests can supply views without a session.
"""

from typing import Protocol

from study.session.watching.watch_view import WatchView


class WatchSource(Protocol):
    """Source of views of a session; implemented by `study.tui.engine.watch_feed.WatchFeed`."""

    def latest(self) -> WatchView | None:
        """The latest view; None before the first. Must not block: the screen's event loop calls it every
        `watch_screen.POLL_EVERY_S`."""
        ...

    @property
    def problem(self) -> str:
        """Why the source has stopped supplying views, as a sentence; empty while it supplies them."""
        ...
