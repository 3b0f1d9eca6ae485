"""Port of requests (stop, pause, note) to a running session, from the screens of the program or from other programs.

Implementations: `QueuedRequests` within the program, `study.store.sessions.request_inbox.RequestInbox` from other
programs.
"""

from queue import Empty, SimpleQueue
from typing import Protocol

from study.session.watching.requests import Request


class RequestPort(Protocol):
    """Source of requests to a running session."""

    def take(self) -> tuple[Request, ...]:
        """Return the new requests since the last call. Must be fast, because it is called at each sign of life of a
        wait, and must not raise."""
        ...


class QueuedRequests:
    """Queue of requests from within the program, for any number of threads that send."""

    def __init__(self) -> None:
        self._queue: SimpleQueue[Request] = SimpleQueue()

    def send(self, request: Request) -> None:
        """Add a request to the queue. May be called from any thread."""
        self._queue.put(request)

    def take(self) -> tuple[Request, ...]:
        """Remove and return the requests in the queue, oldest first. Does not wait."""
        requests = []
        while True:
            try:
                requests.append(self._queue.get_nowait())
            except Empty:
                return tuple(requests)


class CombinedRequests:
    """Source that combines several sources of requests."""

    def __init__(self, *sources: RequestPort) -> None:
        self._sources = sources

    def take(self) -> tuple[Request, ...]:
        """Return the new requests of all sources, in the order of the sources and not by age."""
        return tuple(request for source in self._sources for request in source.take())
