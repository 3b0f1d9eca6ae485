"""The engine as a process of its own, with a scripted screen at the other end of its pipe."""

import os
import queue
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from study.session.facts.events import DeviceFacts
from study.session.facts.void_reasons import SCREEN_DELAYED_BY_LOAD, SCREEN_UNRESPONSIVE
from study.session.views.participant_views import Answered
from study.session.watching.requests import NoteAsked, PauseAsked, StopAsked
from study.store.sessions.log_lock import is_log_locked
from study.tui.engine.engine_commands import _choose_device
from study.tui.engine.from_engine import (
    CloseRequest,
    DisplayCall,
    Failed,
    Finished,
    HomeContent,
    ScreenRequest,
    SessionContent,
    Withdrawn,
)
from study.tui.engine.to_engine import (
    BeginSession,
    ForwardRequest,
    Interrupt,
    Reply,
    Resume,
    SendRequest,
    SessionOrder,
    ShowHome,
    ShowSession,
    Withdraw,
)

pytestmark = [pytest.mark.real_time, pytest.mark.may_be_late]

ROOT = Path(__file__).parents[4]


def asks(call: DisplayCall):
    return lambda message: isinstance(message, ScreenRequest) and message.call is call


def is_a(*kinds: type):
    return lambda message: isinstance(message, kinds)


def third_trial(screen) -> ScreenRequest:
    for _ in range(2):
        screen.reply(screen.wait_for(asks(DisplayCall.ASK)))
    return screen.wait_for(asks(DisplayCall.ASK))


def log_of(session: Path) -> str:
    return (session / "events.jsonl").read_text()


def gone_within(pid: int, seconds: float) -> bool:
    until_s = time.monotonic() + seconds
    while time.monotonic() < until_s:
        if not Path(f"/proc/{pid}").exists() or "Z" in Path(f"/proc/{pid}/stat").read_text().split()[2]:
            return True
        time.sleep(0.02)
    return False


@pytest.mark.slow
def test_a_session_runs_to_its_report_and_is_listed(begun, order, session):
    end = begun.wait_for(is_a(Finished))
    assert Path(end.results.report).is_file()
    assert end.path == str(session)
    begun.send(ShowHome(order.data, order.protocol, order.device))
    home = begun.wait_for(is_a(HomeContent)).view
    assert [line.name for line in home.sessions] == ["P01_001"]
    assert home.protocols[0].name == order.protocol
    begun.send(ShowSession(end.path))
    assert begun.wait_for(is_a(SessionContent)).view.line.standing == "finished"
    begun.send(Withdraw(end.path))
    assert begun.wait_for(is_a(Withdrawn)).sessions == ("P01_001",)
    assert not session.joinpath("events.jsonl").exists()


def test_letting_go_ends_the_sitting_and_it_can_be_resumed(begun, order, session):
    trial = third_trial(begun)
    began_s = time.monotonic()
    begun.send(Interrupt())
    failure = begun.next()
    assert time.monotonic() - began_s < 0.5
    assert isinstance(failure, Failed)
    assert failure.error.title == "Interrupted"
    assert failure.error.saved == "2 answers are on disk."
    assert failure.path == str(session)
    assert failure.error.exit_code == 130
    assert is_log_locked(session / "events.jsonl") is False
    begun.send(Reply(trial.number, Answered(1, time.monotonic())))
    begun.send(Resume("P01_001", "omega3", order.data, follows_log=True))
    assert begun.wait_for(asks(DisplayCall.WELCOME)).content.resumed_after == 2


@pytest.mark.parametrize(
    ("requested", "logged", "opened"),
    [
        ("simulated", DeviceFacts("omega.3", simulated=False, sample_rate_hz=1000.0), "omega3"),
        ("omega7", DeviceFacts("omega.3", simulated=False, sample_rate_hz=1000.0), "omega3"),
        ("omega3", DeviceFacts("simulated omega.3", simulated=True, sample_rate_hz=1000.0), "simulated"),
        ("calibrated:a.h5", DeviceFacts("simulated omega.3", simulated=True, sample_rate_hz=1000.0), "calibrated:a.h5"),
    ],
)
def test_a_session_is_resumed_from_the_list_on_its_own_device(requested, logged, opened):
    assert _choose_device(Resume("P01_001", requested, "data", follows_log=True), logged) == opened
    assert _choose_device(Resume("P01_001", requested, "data"), logged) == requested


@pytest.mark.slow
def test_letting_go_before_the_engine_has_begun_begins_nothing(screen, order, session):
    screen.send(BeginSession(order))
    screen.send(Interrupt())
    failure = screen.next()
    assert isinstance(failure, Failed)
    assert (failure.error.title, failure.path) == ("Interrupted", "")
    assert not session.exists()
    screen.send(BeginSession(order))
    screen.wait_for(asks(DisplayCall.WELCOME))


@pytest.mark.slow
def test_a_reply_of_an_earlier_sitting_answers_nothing_in_the_next(screen, order):
    screen.send(Reply(1, True))
    screen.send(BeginSession(order))
    assert screen.wait_for(is_a(ScreenRequest)).number == 1
    with pytest.raises(queue.Empty):
        screen.next(1.0)


@pytest.mark.slow
def test_a_reply_to_what_is_over_is_ignored(begun, session):
    trial = third_trial(begun)
    begun.send(Reply(trial.number - 1, Answered(2, time.monotonic())))
    begun.send(Reply(trial.number, Answered(1, time.monotonic())))
    assert begun.wait_for(is_a(ScreenRequest)).number > trial.number
    answers = [line for line in log_of(session).splitlines() if "answer_given" in line]
    assert '"answer":1' in answers[-1]


def test_without_a_heartbeat_the_trial_is_void_and_waits_for_a_screen(begun, session):
    trial = third_trial(begun)
    begun.suspend()
    began_s = time.monotonic()
    assert begun.next() == CloseRequest(trial.number)
    assert 0.3 < time.monotonic() - began_s < 1.2
    waiting = begun.next()
    assert isinstance(waiting, ScreenRequest)
    assert waiting.call is DisplayCall.AWAIT_RETURN
    assert waiting.content in (SCREEN_UNRESPONSIVE, SCREEN_DELAYED_BY_LOAD)  # by how busy this computer is
    assert "the screen gave no sign of life" in log_of(session).splitlines()[-1]
    begun.come_back()
    begun.reply(waiting)
    assert begun.next().content.repeated


@pytest.mark.slow
@pytest.mark.parametrize(
    ("request_", "call"), [(PauseAsked("participant"), DisplayCall.PAUSE), (StopAsked("participant"), None)]
)
def test_requests_from_the_screen_reach_the_session(begun, session, request_, call):
    third_trial(begun)
    begun.send(ForwardRequest(NoteAsked("experimenter", "coughed")))
    begun.send(ForwardRequest(request_))
    if call is not None:
        begun.reply(begun.wait_for(asks(call)))
        begun.wait_for(asks(DisplayCall.ASK))
    else:
        begun.wait_for(asks(DisplayCall.GOODBYE))
    assert "coughed" in log_of(session)


@pytest.mark.slow
def test_what_cannot_be_begun_is_reported_and_the_engine_continues(screen, order):
    screen.send(BeginSession(SessionOrder("no_such_protocol", "simulated", "P01", order.data)))
    failure = screen.next()
    assert isinstance(failure, Failed)
    assert "no_such_protocol" in failure.error.happened
    assert failure.path == ""
    screen.send(SendRequest(order.data, PauseAsked("experimenter")))
    assert isinstance(screen.next(), Failed)
    screen.send(ShowHome(order.data))
    assert isinstance(screen.next(), HomeContent)


def test_a_killed_engine_says_what_is_safe_and_how_to_continue(begun, session):
    third_trial(begun)
    os.kill(begun.engine.pid, signal.SIGSEGV)
    failure = begun.next()
    assert isinstance(failure, Failed)
    assert failure.error.title == "The device program ended"
    assert "SIGSEGV" in failure.error.happened
    assert failure.error.saved == "Every answer that was given is on disk."
    assert f"hapteq resume {session}" in failure.error.do_now
    assert failure.error.exit_code == 3
    assert begun.engine.has_failed
    assert is_log_locked(session / "events.jsonl") is False


def test_the_engine_hears_no_key_of_the_terminal_and_writes_nowhere(screen, order, capfd):
    screen.send(ShowHome(order.data))
    screen.next()
    pid = screen.engine.pid
    assert os.getsid(pid) == pid != os.getsid(0)
    for stream in (0, 1, 2):
        assert "/dev/pts" not in str(Path(f"/proc/{pid}/fd/{stream}").readlink())
    assert capfd.readouterr() == ("", "")


SCREEN_THAT_DIES = """
import sys, time
sys.path[:0] = [{root!r}, {here!r}]
import importlib.util
spec = importlib.util.spec_from_file_location("scripted", {conftest!r})
scripted = importlib.util.module_from_spec(spec)
spec.loader.exec_module(scripted)
from study.tui.engine.from_engine import DisplayCall, ScreenRequest
from study.tui.engine.to_engine import BeginSession, SessionOrder
screen = scripted.ScriptedScreen()
screen.send(BeginSession(SessionOrder({protocol!r}, "simulated", "P01", {data!r}, seed=4)))
for _ in range(3):
    trial = screen.wait_for(lambda m: isinstance(m, ScreenRequest) and m.call is DisplayCall.ASK)
    if _ < 2:
        screen.reply(trial)
print(screen.engine.pid, flush=True)
time.sleep(60)
"""


def test_a_killed_screen_takes_the_engine_with_it_and_loses_nothing(screen, order, session):
    conftest = Path(__file__).with_name("conftest.py")
    script = SCREEN_THAT_DIES.format(
        root=str(ROOT), here=str(conftest.parent), conftest=str(conftest), protocol=order.protocol, data=order.data
    )
    other = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True)
    assert other.stdout is not None
    engine = int(other.stdout.readline())
    other.kill()
    other.wait()
    other.stdout.close()
    assert gone_within(engine, 4.5)  # about one on a machine that is not busy; its last resort comes at five
    assert "session_interrupted" in log_of(session).splitlines()[-1]
    screen.send(Resume("P01_001", "simulated", order.data))
    assert screen.wait_for(asks(DisplayCall.WELCOME)).content.resumed_after == 2
