"""A screen without a screen: it answers what an engine asks, as it was told to."""

import queue
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from study.session.views.form_views import FormReply
from study.session.views.participant_views import AfterPause, Answered, DemoDone
from study.tui.engine.client import EngineClient
from study.tui.engine.from_engine import DisplayCall, Failed, Finished, FromEngine, ScreenRequest
from study.tui.engine.to_engine import BeginSession, Heartbeat, Reply, SessionOrder, ToEngine

SHORT = {"after_run_s = 2.0": "after_run_s = 0.1", "trial_limit = 4": "trial_limit = 1"}


def ordinary_reply(ask: ScreenRequest) -> Any:
    match ask.call:
        case DisplayCall.ASK:
            return Answered(1 + ask.number % 2, time.monotonic())
        case DisplayCall.FILL_IN:
            return FormReply({field.key: (*field.choices, "fine")[0] for field in ask.content.fields})
        case DisplayCall.DEVICE_CHECKED:
            return True
        case DisplayCall.CHOOSE_DEMO:
            return DemoDone()
        case DisplayCall.PAUSE:
            return AfterPause.CONTINUE_SITTING
        case DisplayCall.REST:
            return ask.content.seconds
    return None


class ScriptedScreen:
    def __init__(self) -> None:
        self.heard: list[FromEngine] = []
        self._inbox: queue.Queue[FromEngine] = queue.Queue()
        self.engine = EngineClient(self._inbox.put)
        self._beating = threading.Event()
        self._beating.set()
        self._over = False
        self.engine.start()
        threading.Thread(target=self._beat, daemon=True).start()

    def send(self, message: ToEngine) -> None:
        self.engine.send(message)

    def suspend(self) -> None:
        self._beating.clear()

    def come_back(self) -> None:
        self._beating.set()

    def next(self, timeout_s: float = 30.0) -> FromEngine:
        message = self._inbox.get(timeout=timeout_s)
        self.heard.append(message)
        return message

    def wait_for(self, wanted: Callable[[FromEngine], bool], reply: bool = True) -> Any:
        """Answers all that comes before what is wanted."""
        while not wanted(message := self.next()):
            assert not isinstance(message, Failed | Finished), message
            if reply and isinstance(message, ScreenRequest):
                self.reply(message)
        return message

    def reply(self, ask: ScreenRequest) -> None:
        self.send(Reply(ask.number, ordinary_reply(ask)))

    def close(self) -> None:
        self._over = True
        self.engine.close()

    def _beat(self) -> None:
        while not self._over:
            if self._beating.wait(0.1):
                self.send(Heartbeat())
            time.sleep(0.1)


@pytest.fixture
def screen() -> Iterator[ScriptedScreen]:
    made = ScriptedScreen()
    yield made
    made.close()


@pytest.fixture
def order(tmp_path, small_text) -> SessionOrder:
    for there, wanted in SHORT.items():
        assert there in small_text
        small_text = small_text.replace(there, wanted)
    path = tmp_path / "small.toml"
    path.write_text(small_text)
    return SessionOrder(str(path), "simulated", "P01", str(tmp_path / "data"), seed=4)


@pytest.fixture
def begun(screen, order) -> ScriptedScreen:
    screen.send(BeginSession(order))
    return screen


@pytest.fixture
def session(order) -> Path:
    return Path(order.data) / "P01_001"
