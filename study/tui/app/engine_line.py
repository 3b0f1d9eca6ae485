"""Connection of the application to the engine: messages out, messages in as Textual messages, and a heartbeat."""

from __future__ import annotations

from typing import Any

from textual.app import App
from textual.message import Message

from study.tui.engine.client import EngineClient
from study.tui.engine.from_engine import Failed, Finished, FromEngine
from study.tui.engine.to_engine import Begin, Heartbeat, Resume, ToEngine

HEARTBEAT_S = 0.1
"""Interval of the application's sign of life to the engine (s)."""


class EngineMessage(Message):
    """A message of the engine as an event of the application."""

    def __init__(self, message: FromEngine) -> None:
        super().__init__()
        self.message = message


class EngineLine:
    """The application's connection to the engine: sends commands and heartbeats, delivers messages as events."""

    def __init__(self, app: App[Any]) -> None:
        self._app = app
        self._engine = EngineClient(self._deliver)
        self.last_end: Finished | Failed | None = None
        """Also one that comes when the application is leaving already."""

    @property
    def pid(self) -> int | None:
        """Process id of the engine."""
        return self._engine.pid

    def start(self) -> None:
        """Returns at once. The heartbeat comes from the event loop, so it stops when that hangs or is suspended."""
        self._engine.start()
        self._app.set_interval(HEARTBEAT_S, self._beat)

    def send(self, message: ToEngine) -> None:
        """Returns at once. Starts another engine if the last one died."""
        if self._engine.dead:
            self._engine = EngineClient(self._deliver)
            self._engine.start()
        if isinstance(message, Begin | Resume):
            self.last_end = None
        self._engine.send(message)

    def close(self) -> None:
        """Wait until the engine has released the force and ended."""
        self._engine.close()

    def _beat(self) -> None:
        if not self._engine.dead:
            self._engine.send(Heartbeat())

    def _deliver(self, message: FromEngine) -> None:
        if isinstance(message, Finished | Failed):
            self.last_end = message
        self._app.post_message(EngineMessage(message))
