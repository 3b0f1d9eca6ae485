"""Connection of the application to the engine process.

It sends commands and a regular heartbeat, and delivers the engine's messages as events of Textual, so that they are
handled by the event loop. Without a heartbeat the engine ends a running trial (`remote_display`).
"""

from __future__ import annotations

from typing import Any

from textual.app import App
from textual.message import Message

from study.tui.engine.client import EngineClient
from study.tui.engine.from_engine import Failed, Finished, FromEngine
from study.tui.engine.to_engine import BeginSession, Heartbeat, Resume, ToEngine

HEARTBEAT_INTERVAL_S = 0.1
"""Interval of the heartbeat (s). Chosen: well below the silence after which the engine ends a trial
(`remote_display.HEARTBEAT_TIMEOUT_S`)."""


class EngineMessage(Message):
    """A message from the engine, wrapped as an event of Textual."""

    def __init__(self, message: FromEngine) -> None:
        super().__init__()
        self.message = message


class EngineConnection:
    """Connection to the engine; posts its messages to the application as `EngineMessage`."""

    def __init__(self, app: App[Any]) -> None:
        self._app = app
        self._engine = EngineClient(self._deliver)
        self.last_end: Finished | Failed | None = None
        """The last message of the engine on the end of a sitting or on a failure; None after the start of a sitting.
        Stored here, because an end that comes while the application closes is no longer handled as an event."""

    @property
    def pid(self) -> int | None:
        return self._engine.pid

    def start(self) -> None:
        """Start the engine and the heartbeat, and return at once. The event loop sends the heartbeat, which therefore
        stops when the loop hangs or the application is suspended."""
        self._engine.start()
        self._app.set_interval(HEARTBEAT_INTERVAL_S, self._send_heartbeat)

    def send(self, message: ToEngine) -> None:
        """Send a message and return at once. Starts a new engine first if the present one has failed."""
        if self._engine.has_failed:
            self._engine = EngineClient(self._deliver)
            self._engine.start()
        if isinstance(message, BeginSession | Resume):
            self.last_end = None
        self._engine.send(message)

    def close(self) -> None:
        """Close the pipe, and wait until the engine has released the force and ended, or was killed."""
        self._engine.close()

    def _send_heartbeat(self) -> None:
        """Send a heartbeat, unless the engine has failed."""
        if not self._engine.has_failed:
            self._engine.send(Heartbeat())

    def _deliver(self, message: FromEngine) -> None:
        """Post a message of the engine to the application. Called in a thread of the client."""
        if isinstance(message, Finished | Failed):
            self.last_end = message
        self._app.post_message(EngineMessage(message))
