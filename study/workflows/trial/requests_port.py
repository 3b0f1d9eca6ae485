"""The port of requests from viewers and second screens to a running session."""

from queue import Empty, SimpleQueue
from typing import Protocol

from study.session.watching.requests import Request


class Requests(Protocol):
    """Interface of a source of requests to a running session."""

    def take(self) -> tuple[Request, ...]:
        """New requests since the last call, oldest first. Fast: called about twenty times a second. Never raises."""
        ...


class QueuedRequests:
    """Requests from within the program: `send` may be called from any thread."""

    def __init__(self) -> None:
        self._queue: SimpleQueue[Request] = SimpleQueue()

    def send(self, request: Request) -> None:
        """Put a request into the queue. From any thread."""
        self._queue.put(request)

    def take(self) -> tuple[Request, ...]:
        requests = []
        while True:
            try:
                requests.append(self._queue.get_nowait())
            except Empty:
                return tuple(requests)


class ManyRequests:
    """Combines several sources of requests."""

    def __init__(self, *sources: Requests) -> None:
        self._sources = sources

    def take(self) -> tuple[Request, ...]:
        """In the order of the sources, not by age."""
        return tuple(request for source in self._sources for request in source.take())
