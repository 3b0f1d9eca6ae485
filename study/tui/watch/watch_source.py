"""The port that provides views to the experimenter's screen."""

from typing import Protocol

from study.session.watching.watch_view import WatchView


class WatchSource(Protocol):
    """Source of views; implemented by `study.tui.engine.watch_feed.WatchFeed`."""

    def latest(self) -> WatchView | None:
        """The latest view, without blocking: called ten times a second by the event loop."""
        ...

    @property
    def problem(self) -> str:
        """Why no views come any more, a sentence; empty otherwise."""
        ...
