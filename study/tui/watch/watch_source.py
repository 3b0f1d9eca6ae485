"""Port between the experimenter's screen and the source of its views of a running session.

The screen depends on this protocol alone, so that tests can give it views without a session.
"""

from typing import Protocol

from study.session.watching.watch_view import WatchView


class WatchSource(Protocol):
    """Source of views of a session; implemented by `study.tui.engine.watch_feed.WatchFeed`."""

    def latest(self) -> WatchView | None:
        """The latest view, None before the first. Must not block: the screen's event loop calls it ten times a
        second."""
        ...

    @property
    def problem(self) -> str:
        """Sentence that says why no further views come; empty while they come."""
        ...
