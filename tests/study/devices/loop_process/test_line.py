"""This side of a pipe: what is kept of an answer, what cannot be sent or read, and what is begun too late."""

import threading
from multiprocessing import Pipe

import pytest

from study.devices.device import Fault
from study.devices.loop_process import start
from study.devices.loop_process.call_pipe import VALUE, CallPipe, LoopGoneError
from study.devices.loop_process.start import LoopProcess
from study.errors import DeviceError


@pytest.fixture
def pipe():
    """A line, and the other end of its pipe."""
    ours, theirs = Pipe()
    line = CallPipe(ours, "test")
    yield line, theirs
    line.close_after_calls()
    theirs.close()


def test_an_answer_that_comes_together_with_an_interruption_is_kept(pipe, monkeypatch):
    line, theirs = pipe
    call = line.queue_call("ask")
    theirs.send((VALUE, 7))
    take = call._wait_for_progress

    def interrupted(*patience) -> None:
        take(*patience)
        raise KeyboardInterrupt

    monkeypatch.setattr(call, "_wait_for_progress", interrupted)
    with pytest.raises(KeyboardInterrupt):
        call.wait_for_answer(20.0)
    monkeypatch.setattr(call, "_wait_for_progress", take)
    assert call.wait_for_answer(0.0, grace_s=0.0) == 7


def test_only_what_carries_much_is_waited_for_longer(pipe, monkeypatch):
    call = pipe[0].queue_call("play")
    shares = iter([0.0, 0.5, 1.0])
    waited_s: list[float] = []

    def take(patience_s: float, grace_s: float | None) -> float | None:
        waited_s.append(patience_s)
        if (share := next(shares, None)) is None:
            call.receive((VALUE, 7))
        return share

    monkeypatch.setattr(call, "_wait_for_progress", take)
    assert call.wait_for_answer(3.0, sending_s=2.0) == 7
    assert waited_s == [5.0, 3.0, 3.0, 5.0]


def test_a_process_that_cannot_be_killed_is_not_said_to_be_gone(monkeypatch):
    process = LoopProcess()
    monkeypatch.setattr(start, "KILL_TIMEOUT_S", 0.1)
    monkeypatch.setattr(process._process, "kill", lambda: None)
    try:
        assert process.end(0.0) == "was killed, but has not ended"
    finally:
        monkeypatch.undo()
        monkeypatch.setattr(start, "KILL_TIMEOUT_S", 60.0)  # a busy computer ends a process late
        process.hang_up()
        assert process.end(0.0) == "and was killed"


def test_a_release_whose_answer_came_with_an_interruption_is_asked_for_again(device, rigs, monkeypatch):
    device.hold(rigs.push())
    device.keep_alive()
    noted, answered = device._store_health, []

    def interrupted(health) -> None:
        answered.append(health)
        monkeypatch.setattr(device, "_store_health", noted)
        raise KeyboardInterrupt

    monkeypatch.setattr(device, "_store_health", interrupted)
    with pytest.raises(KeyboardInterrupt):
        device.release()
    assert [device.release().health] == answered
    with pytest.raises(DeviceError, match="Nothing is held"):
        device.release()


def test_what_cannot_be_sent_raises_where_it_was_asked_and_loses_nothing(device, rigs):
    with pytest.raises(Exception, match="pickle"):
        device.play(lambda: None)
    with pytest.raises(Exception, match="pickle"):
        device.hold(lambda: None)
    assert device.fault() is Fault.NONE
    device.hold(rigs.push())
    device.keep_alive()
    device.release()


def test_why_an_answer_cannot_be_read_is_said(pipe):
    line, theirs = pipe
    call = line.queue_call("ask")
    theirs.send_bytes(b"no pickle")
    with pytest.raises(LoopGoneError, match=r"its answer cannot be read \(UnpicklingError: .+\)"):
        call.wait_for_answer(20.0)


def test_a_call_after_the_end_of_its_line_is_refused_at_once(pipe, monkeypatch):
    line, theirs = pipe
    waiting = line.queue_call("ask")
    line.close_after_calls()
    queued = line.queue_call("ask")
    theirs.send((VALUE, 7))
    assert waiting.wait_for_answer(20.0) == 7
    assert line._ended.wait(20.0)
    for call in (queued, line.queue_call("ask")):
        with pytest.raises(LoopGoneError, match="it was given up"):
            call.wait_for_answer(20.0)


def test_a_call_that_races_with_a_close_says_that_the_device_is_closed(behind, served, rigs, hang, monkeypatch):
    monkeypatch.setattr(behind, "hold", lambda stimulus: hang.wait())
    device = served.remote(behind, rigs.SETTINGS)
    errors: list[DeviceError] = []

    def hold() -> None:
        with pytest.raises(DeviceError) as refusal:
            device.hold(rigs.push())
        errors.append(refusal.value)

    holding = threading.Thread(target=hold)
    holding.start()
    device.close()
    holding.join()
    assert "The device is closed" in str(errors[0])
