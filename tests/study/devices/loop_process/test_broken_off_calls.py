"""Calls that are refused, interrupted, or not answered: what the next call gets, and what is left running."""

import contextlib
import os
import pickle
import signal
import subprocess
import sys
import threading
from dataclasses import replace

import pytest

from study.devices.device import Fault, PlaybackResult
from study.devices.loop_process import call_pipe, remote_device, start
from study.errors import DeviceError
from tests.study.devices.loop_process.awaited import LATEST_S, becomes, runs


def interrupt_soon() -> None:
    threading.Timer(0.2, os.kill, (os.getpid(), signal.SIGINT)).start()


def test_after_a_refused_release_the_next_stimulus_is_released(device, rigs, rig):
    with pytest.raises(DeviceError, match="Nothing is held"):
        device.release()
    device.hold(rigs.push())
    device.keep_alive()
    device.release()
    assert not rig.last_n.any()
    with pytest.raises(DeviceError, match="Nothing is held"):
        device.release()


def test_until_an_interrupted_release_is_asked_for_again_nothing_else_begins(device, rigs, rig):
    device.hold(rigs.sine(1.0, fade_s=1.0))
    device.keep_alive()
    interrupt_soon()
    with pytest.raises(KeyboardInterrupt):
        device.release()
    for begin in (lambda: device.hold(rigs.push()), lambda: device.play(rigs.sine(1.0).loop)):
        with pytest.raises(DeviceError, match=r"It is still playing\. Call release first"):
            begin()
    device.release()
    device.hold(rigs.push())
    device.keep_alive()
    device.release()
    assert not rig.last_n.any()


def test_a_stop_is_heard_while_a_close_hangs(behind, served, rigs, rig, hang, monkeypatch):
    close = behind.close
    monkeypatch.setattr(behind, "close", lambda: [hang.wait(), close()][1])
    device = served.remote(behind, rigs.SETTINGS)
    device.hold(rigs.push())
    closing = threading.Thread(target=device.close)
    closing.start()
    assert device._process.server.ended.wait(LATEST_S)
    device.stop()
    assert not rig.last_n.any()
    assert device.fault() is Fault.STOPPED
    assert device.look().position_m is not None  # nor was it killed
    hang.set()
    closing.join()


def test_a_stop_that_is_not_answered_kills_the_process_without_a_grace(
    behind, served, rigs, hang, monkeypatch, impatient
):
    monkeypatch.setattr(behind, "stop", hang.wait)
    monkeypatch.setattr(call_pipe, "ANSWER_GRACE_S", 3600.0)
    device = served.remote(behind, rigs.SETTINGS)
    device.hold(rigs.push())
    with device._loss_lock:  # as a call that waits for the end of a process that hung up
        stopping = threading.Thread(target=device.stop, daemon=True)
        stopping.start()
        becomes(lambda: device._process.killed)
    stopping.join()
    assert device.fault() is Fault.LOST
    device.close()


def test_an_interrupted_close_hangs_up_and_can_be_made_good_for(behind, served, rigs, rig, hang, monkeypatch):
    close = behind.close
    monkeypatch.setattr(behind, "close", lambda: [hang.wait(), close()][1])
    device = served.remote(behind, rigs.SETTINGS)
    device.hold(rigs.push())
    interrupt_soon()
    with pytest.raises(KeyboardInterrupt):
        device.close()
    becomes(lambda: device._process.work._connection.closed)
    with pytest.raises(DeviceError, match="The device is closed"):
        device.hold(rigs.push())
    hang.set()
    device.close()
    assert device._process.patience_s == [remote_device.CLOSE_TIMEOUT_S]
    assert rig.closed and not rig.last_n.any()


INTERRUPTED = """
import os, pickle, signal, sys
from study.devices.clock import RealClock
from study.devices.loop_process import remote_device
from study.devices.opening import open_device
remote_device.CLOSE_TIMEOUT_S = 0.2
device = open_device("omega3", pickle.load(sys.stdin.buffer), RealClock(), 1)
print(device._process.pid)
os.kill(device._process.pid, signal.SIGSTOP)

def interrupted(*arguments):
    raise KeyboardInterrupt

device._process.close.queue_call = interrupted
device.close()
"""


@pytest.mark.real_time
def test_a_program_that_is_interrupted_as_it_closes_leaves_no_process_that_hangs(stub, rigs):
    program = subprocess.run(
        [sys.executable, "-c", INTERRUPTED], input=pickle.dumps(rigs.SETTINGS), capture_output=True, timeout=120
    )
    pid = int(program.stdout)
    try:
        assert b"KeyboardInterrupt" in program.stderr
        becomes(lambda: not runs(pid))
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.kill(pid, signal.SIGKILL)


def interrupted(*arguments) -> None:
    raise KeyboardInterrupt


def test_an_interruption_while_the_process_starts_leaves_none(rigs, monkeypatch):
    started: list[subprocess.Popen] = []
    really = start._start_process
    monkeypatch.setattr(start, "_start_process", lambda *ends: started.append(really(*ends)) or started[0])
    monkeypatch.setattr(start, "CallPipe", interrupted)
    with pytest.raises(KeyboardInterrupt):
        remote_device.open_remotely("omega3", rigs.SETTINGS, 1)
    assert started[0].wait(LATEST_S) == -signal.SIGKILL


def test_an_interruption_before_the_device_opens_ends_the_process(behind, served, rigs, monkeypatch):
    process = served.ServedHere(behind)
    monkeypatch.setattr(remote_device, "LoopProcess", lambda: process)
    monkeypatch.setattr(process.work, "queue_call", interrupted)
    with pytest.raises(KeyboardInterrupt):
        remote_device.open_remotely("omega3", rigs.SETTINGS, 1)
    assert process.patience_s == [remote_device.CLOSE_TIMEOUT_S]
    assert process.server.ended.is_set()


@pytest.mark.parametrize("said_by", ["fault", "health", "release"])
def test_a_force_that_was_left_on_is_not_forgotten_with_the_process(behind, served, rigs, monkeypatch, said_by):
    left = replace(behind.health(), fault=Fault.FORCE_LEFT)
    answers = {"fault": Fault.FORCE_LEFT, "health": left, "release": PlaybackResult(recording=None, health=left)}
    monkeypatch.setattr(behind, said_by, lambda: answers[said_by])
    with contextlib.closing(served.remote(behind, rigs.SETTINGS)) as device:
        getattr(device, said_by)()
        device.stop()
        device._process.die()
        assert device.fault() is device.health().fault is Fault.FORCE_LEFT


def test_a_stop_that_was_answered_is_not_forgotten_with_the_process(device, rigs):
    device.hold(rigs.push())
    device.stop()
    device._process.die()
    assert device.fault() is Fault.STOPPED


HANGING = """
import atexit, pickle, sys, time
from multiprocessing import Pipe
from types import SimpleNamespace
from study.devices.loop_process import serve
where, settings = pickle.load(sys.stdin.buffer)

def hang(*arguments, **named):
    time.sleep(3600)

calls = dict.fromkeys(("hold", "release", "play", "keep_alive", "fault", "health", "look", "stop"))
device = SimpleNamespace(info=None, close=hang if where == "close" else lambda: None, **calls)
serve.open_device = hang if where == "open" else lambda *arguments, **named: device
serve.EXIT_GRACE_S = 0.5
if where == "exit":
    atexit.register(hang)
pairs = [Pipe() for _ in serve.PIPE_NAMES]
pairs[0][0].send(("open", ("omega3", settings, 1, "")))
serve.run(0, *[end.fileno() for _, end in pairs])
"""
"""Its parent is another process than it was told, as if that had ended, and both ends of its pipes are open."""


@pytest.mark.parametrize("where", ["open", pytest.param("close", marks=pytest.mark.slow), "exit"])
def test_a_process_that_hangs_when_its_program_is_gone_ends_all_the_same(rigs, where):
    program = subprocess.run(
        [sys.executable, "-c", HANGING], input=pickle.dumps((where, rigs.SETTINGS)), capture_output=True, timeout=120
    )
    assert program.returncode == 1, program.stderr.decode()
    assert not program.stderr
