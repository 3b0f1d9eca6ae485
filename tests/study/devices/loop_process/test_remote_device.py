"""The device port over pipes, with the other side in a thread of the test: what goes through, and what is never waited
for without a bound."""

import contextlib
import errno
import os
import signal
import threading
import time
from multiprocessing import Pipe

import numpy as np
import pytest

from study.devices.device import Fault
from study.devices.loop_process import call_pipe, start
from study.devices.loop_process.serve import DeviceServer
from study.errors import DeviceError, WrongUseError
from tests.slow_instances import slow_rows


class OddError(Exception):
    """Cannot be sent."""

    def __init__(self, first: str, second: str) -> None:
        super().__init__(first)


@pytest.mark.parametrize(
    ("raised", "kind", "said"),
    [
        (DeviceError("a", "b.", "c."), DeviceError, "a. b. c."),
        (WrongUseError("a", "b.", "c."), WrongUseError, "a. b. c."),
        (SystemExit(3), RuntimeError, "SystemExit: 3"),
        *slow_rows((ValueError("no"), ValueError, "no"), (OddError("odd", "x"), RuntimeError, "OddError: odd")),
    ],
)
def test_an_error_on_the_other_side_is_raised_on_this_one(behind, served, monkeypatch, rigs, raised, kind, said):
    def fail(stimulus) -> None:
        raise raised

    monkeypatch.setattr(behind, "hold", fail)
    with contextlib.closing(served.remote(behind, rigs.SETTINGS)) as device:
        with pytest.raises(kind) as error:
            device.hold(rigs.push())
        assert str(error.value) == said
        assert device.fault() is Fault.NONE


def test_a_stop_and_all_questions_are_heard_while_a_release_hangs(behind, served, rigs, rig, hang, monkeypatch):
    release = behind.release
    monkeypatch.setattr(behind, "release", lambda: [hang.wait(), release()][1])
    with contextlib.closing(served.remote(behind, rigs.SETTINGS)) as device:
        device.hold(rigs.push())
        waiting = threading.Thread(target=device.release)
        waiting.start()
        time.sleep(0.1)
        assert rig.last_n.any()
        device.keep_alive()
        assert device.fault() is Fault.NONE
        assert device.health().ticks > 0
        assert device.look().position_m is not None
        device.stop()
        assert not rig.last_n.any()
        assert device.fault() is Fault.STOPPED
        assert waiting.is_alive()
        hang.set()
        waiting.join()


@pytest.mark.real_time
def test_looks_and_questions_are_no_signs_of_life(device, rigs, rig):
    device.hold(rigs.push())
    until_s = time.monotonic() + rigs.LIMITS.watchdog_s + rigs.LIMITS.release_s + 0.5
    while time.monotonic() < until_s:
        device.look(), device.fault(), device.health()
        time.sleep(0.02)
    assert device.fault() is Fault.STALLED
    assert not rig.last_n.any()
    assert device.release().health.fault is Fault.STALLED


@pytest.mark.real_time
def test_a_caller_that_hangs_while_it_plays_gives_no_sign_of_life(device, rigs, rig):
    forces: list[float] = []

    def hang_at_half(share: float) -> None:
        if share > 0.5 and not forces:
            time.sleep(rigs.LIMITS.watchdog_s + rigs.LIMITS.release_s + 0.5)
            forces.append(float(np.linalg.norm(rig.last_n)))

    played = device.play(rigs.force(np.tile(rigs.sine(1.0).loop.samples, (20, 1))), hang_at_half)
    assert (played.health.fault, played.recording) == (Fault.STALLED, None)
    assert forces == [0.0]


def test_what_the_progress_raises_ends_the_playing_with_a_fade(device, rigs, rig):
    def leave(share: float) -> None:
        if share > 0.3:
            raise KeyboardInterrupt

    commands = rigs.force(np.tile(rigs.sine(1.0).loop.samples, (20, 1)))
    with pytest.raises(KeyboardInterrupt):
        device.play(commands, leave)
    assert not rig.last_n.any()
    assert rigs.violations(np.array(rig.written_n), rigs.LIMITS) == []
    device.hold(rigs.push())  # idle again, and the pipes are in step
    device.keep_alive()
    assert device.release().health.fault is Fault.NONE


def test_an_interrupted_release_can_be_asked_for_again(device, rigs):
    device.hold(rigs.sine(1.0, fade_s=1.0))
    device.keep_alive()
    threading.Timer(0.2, os.kill, (os.getpid(), signal.SIGINT)).start()
    with pytest.raises(KeyboardInterrupt):
        device.release()
    assert device.release().health.fault is Fault.NONE
    with pytest.raises(DeviceError, match="Nothing is held"):
        device.release()


def check_it_is_lost(device, rigs, said: str) -> None:
    """And nothing is asked of it any more, so nothing is waited for."""
    asked: list[str] = []
    for each in device._process.lines:
        each.queue_call = lambda name, *arguments: asked.append(name)
    assert device.fault() is device.health().fault is Fault.LOST
    device.keep_alive()
    assert device.look().position_m is None
    played = device.release()
    assert (played.recording, played.health.fault) == (None, Fault.LOST)
    for call in (device.release, lambda: device.hold(rigs.push()), lambda: device.play(rigs.force(np.zeros((9, 3))))):
        with pytest.raises(DeviceError, match=f"The device was lost.*{said}.*hapteq resume"):
            call()
    device.stop()
    assert device.fault() is Fault.LOST  # no stop was answered
    assert not asked


def test_a_process_that_does_not_answer_is_killed_and_the_device_is_lost(
    behind, served, rigs, hang, monkeypatch, impatient
):
    monkeypatch.setattr(behind, "fault", lambda: hang.wait() and Fault.NONE)
    device = served.remote(behind, rigs.SETTINGS)
    device.hold(rigs.push())
    assert device.fault() is Fault.LOST
    assert device._process.patience_s == [0.0]
    check_it_is_lost(device, rigs, "did not answer for 0.2 s, and was killed")
    device.close()
    hang.set()
    behind.close()


@pytest.mark.parametrize("first", ["keep_alive", "fault", "health", "look", "stop", "release"])
def test_after_the_end_of_its_process_a_device_is_lost_to_every_call(device, rigs, rig, first):
    device.hold(rigs.push())
    device._process.die()
    getattr(device, first)()
    assert device._loss_reason.startswith("it ended")
    assert not rig.last_n.any()  # the server let go as its pipes closed
    if first not in ("stop", "release"):
        check_it_is_lost(device, rigs, "it ended, with code 0")
    device.close()


def test_a_play_whose_process_ends_raises(device, rigs):
    commands = rigs.force(np.tile(rigs.sine(1.0).loop.samples, (20, 1)))
    with pytest.raises(DeviceError, match="The device was lost"):
        device.play(commands, lambda share: device._process.die() if share > 0.3 else None)


def test_only_what_a_stop_and_a_sign_of_life_wait_for_goes_before_other_programs(behind):
    first: list[str] = []

    @contextlib.contextmanager
    def noted():
        first.append(threading.current_thread().name)
        yield

    pairs = [Pipe() for _ in call_pipe.PIPE_NAMES]
    server = DeviceServer(behind, tuple(theirs for _, theirs in pairs), raise_thread_priority=noted)
    server.start()
    for ours, _ in pairs:
        ours.close()
    assert server.ended.wait(20.0)
    server.close()
    assert sorted(first) == ["serve signs", "serve stop"]


def test_pipes_that_the_system_refuses_are_a_device_error(monkeypatch):
    def refuse():
        raise OSError(errno.EMFILE, os.strerror(errno.EMFILE))

    monkeypatch.setattr(start, "Pipe", refuse)
    with pytest.raises(DeviceError, match="loop cannot be started.*Too many open files"):
        start.LoopProcess()


def test_closing_leaves_the_handle_free_and_the_last_health_known(device, rigs, rig):
    device.hold(rigs.push())
    device.keep_alive()
    time.sleep(0.1)
    device.close()
    assert rig.closed and not rig.last_n.any()
    assert rigs.violations(np.array(rig.written_n), rigs.LIMITS) == []
    assert device.fault() is Fault.NONE
    assert device.health().ticks > 0
    assert device.look().position_m is None
    device.keep_alive(), device.stop()
