"""The port of requests: what watchers and second screens ask of a running session."""

from typing import Protocol

from study.session.requests import Request


class Requests(Protocol):
    def take(self) -> tuple[Request, ...]:
        """Those that came since the last call, oldest first. Cheap: asked some twenty times a second. Never raises."""
        ...


class NoRequests:
    """Nobody can reach the session."""

    def take(self) -> tuple[Request, ...]:
        return ()
