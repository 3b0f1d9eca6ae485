"""The screen's end of the pipe, with engines that cannot be trusted."""

import queue
import time

import pytest

from study.tui.engine.child_process import start_child
from study.tui.engine.client import EngineClient
from study.tui.engine.from_engine import Failed, SessionReady
from study.tui.engine.to_engine import ShowHome

pytestmark = [pytest.mark.real_time, pytest.mark.may_be_late]

ENGINES = """
import os, sys
from multiprocessing.connection import Connection

def talks_nonsense(descriptor):
    pipe = Connection(descriptor)
    pipe.send_bytes(b"nothing that was pickled")
    try:
        while True:
            pipe.recv()
    except EOFError:
        pass

def loses_the_device(descriptor):
    from study.tui.engine.from_engine import SessionReady
    Connection(descriptor).send(SessionReady("P01_001", "data/P01_001", "omega3"))
    sys.exit(3)

def gives_up(descriptor):
    sys.stderr.write("first words\\nno device on the bus\\n")
    sys.exit(4)
"""


@pytest.fixture
def engine(tmp_path, monkeypatch):
    (tmp_path / "strange_engines.py").write_text(ENGINES)
    monkeypatch.syspath_prepend(tmp_path)
    clients = []

    def start(function: str) -> tuple[EngineClient, queue.Queue]:
        def strange(module, name, *, output):
            return start_child("strange_engines", function, output=output)

        monkeypatch.setattr("study.tui.engine.client.start_child", strange)
        heard = queue.Queue()
        clients.append(EngineClient(heard.put))
        clients[-1].start()
        return clients[-1], heard

    yield start
    for client in clients:
        client.close()


def test_an_engine_that_talks_nonsense_is_told_as_ended_and_does_end(engine, capfd):
    client, heard = engine("talks_nonsense")
    client.send(ShowHome("."))
    failure = heard.get(timeout=20.0)
    assert isinstance(failure, Failed)
    assert failure.error.title == "The device program ended"
    assert client.has_failed
    assert "UnpicklingError" in capfd.readouterr().err


def test_the_last_words_of_an_engine_are_reported(engine):
    client, heard = engine("gives_up")
    failure = heard.get(timeout=20.0)
    assert failure.error.happened == (
        "The process that drives the device ended with code 4. Its last words: no device on the bus"
    )
    assert failure.path == ""
    client.close()


def test_the_command_that_continues_a_session_names_its_device(engine):
    _, heard = engine("loses_the_device")
    assert isinstance(heard.get(timeout=20.0), SessionReady)
    failure = heard.get(timeout=20.0)
    assert failure.path == "data/P01_001"
    assert failure.error.do_now.endswith("Then continue with: hapteq resume data/P01_001 --device omega3")


def test_a_system_that_starts_nothing_is_reported(monkeypatch):
    def refuse(*arguments, output):
        raise OSError(11, "Resource temporarily unavailable")

    monkeypatch.setattr("study.tui.engine.client.start_child", refuse)
    heard = queue.Queue()
    client = EngineClient(heard.put)
    client.start()
    failure = heard.get(timeout=20.0)
    assert failure.error.title == "The device program cannot be started"
    assert "Resource temporarily unavailable" in failure.error.happened
    client.close()


def test_closing_takes_no_time_where_nothing_was_started():
    began_s = time.monotonic()
    EngineClient(lambda message: None).close()
    assert time.monotonic() - began_s < 0.1
