"""The port of the watcher's screen: where its views come from."""

from typing import Protocol

from study.session.watching.watch_view import WatchView


class WatchSource(Protocol):
    """Where views come from; `study.tui.engine.watch_feed.WatchFeed` is one."""

    def latest(self) -> WatchView | None:
        """At once, without any work: called ten times a second by the event loop."""
        ...

    @property
    def problem(self) -> str:
        """Why no views come any more, a sentence; empty while they come."""
        ...
