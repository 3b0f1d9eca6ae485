"""A driver that hangs, fails or dies while it holds a force: whatever happens, the last thing it gets is zero."""

import contextlib
import signal
import struct
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest

from study.devices.clock import RealClock, VirtualClock
from study.devices.device import Fault
from study.devices.drive.stepped_runner import SteppedRunner
from study.devices.governor import govern
from study.devices.governor.governor import Governor
from study.devices.safe import SafeDevice
from study.errors import DeviceError

pytestmark = pytest.mark.real_time

TESTS = Path(__file__).parents[2]


@pytest.fixture
def rig(rigs):
    return rigs.HeldForceRig()


@pytest.fixture
def hang():
    """Blocks whoever waits for it, until the test is over."""
    event = threading.Event()
    yield event
    event.set()


@pytest.fixture
def device(rigs, rig, hang):
    device = SafeDevice(rig, rigs.SETTINGS, RealClock())
    yield device
    hang.set()
    device.close()


def alive(device, seconds: float) -> None:
    until_s = time.monotonic() + seconds
    while time.monotonic() < until_s:
        device.keep_alive()
        time.sleep(0.01)


def hold(device, rigs, rig) -> None:
    device.hold(rigs.push())
    alive(device, 0.15)
    assert rig.last_n[0] == pytest.approx(2.9)


def in_loop(action):
    """Only in the haptic loop: other threads get through."""
    return lambda *_: action() if threading.current_thread().name == "haptic loop" else None


def wait_until(true, seconds: float = 2.0) -> None:
    until_s = time.monotonic() + seconds
    while not true() and time.monotonic() < until_s:
        time.sleep(0.005)
    assert true()


def test_a_sensor_that_hangs_loses_the_force_although_the_program_is_alive(device, rigs, rig, hang):
    hold(device, rigs, rig)
    rig.before_sensing = hang.wait
    alive(device, 0.3)
    assert not rig.last_n.any()
    assert device.fault() is Fault.LOST
    assert device.release().health.fault is Fault.LOST
    with pytest.raises(DeviceError, match=r"no sign of life\)\. Its force is off"):
        device.hold(rigs.push())


def test_whoever_only_asks_for_faults_finds_the_hanging_loop_too(device, rigs, rig, hang):
    hold(device, rigs, rig)
    rig.before_sensing = hang.wait
    time.sleep(0.15)
    assert device.fault() is Fault.LOST
    assert not rig.last_n.any()


def test_a_release_does_not_wait_long_for_a_hanging_sensor(device, rigs, rig, hang):
    hold(device, rigs, rig)
    rig.before_sensing = hang.wait
    started_s = time.monotonic()
    assert device.release().health.fault is Fault.LOST
    assert time.monotonic() - started_s < 0.5
    assert not rig.last_n.any()


def test_an_emergency_stop_needs_no_loop(device, rigs, rig, hang):
    hold(device, rigs, rig)
    rig.before_sensing = hang.wait
    time.sleep(0.02)
    device.stop()
    assert not rig.last_n.any()
    assert device.fault() is Fault.STOPPED
    hang.set()
    time.sleep(0.05)
    assert not rig.last_n.any()


def test_an_emergency_stop_that_the_loop_hears_is_left_to_it(device, rigs, rig):
    hold(device, rigs, rig)
    device.stop()
    assert not rig.last_n.any()
    assert device.release().health.fault is Fault.STOPPED


def test_commands_end_when_the_sensor_hangs(device, rigs, rig, hang):
    def hang_in_the_middle(share: float) -> None:
        if share > 0.6:
            rig.before_sensing = hang.wait

    with pytest.raises(DeviceError, match="no sign of life"):
        device.play(rigs.force(np.zeros((1000, 3))), hang_in_the_middle)


def test_a_write_that_goes_through_late_is_taken_back(device, rigs, rig, hang):
    hold(device, rigs, rig)
    rig.before_writing = in_loop(hang.wait)
    time.sleep(0.02)
    assert device.release().health.fault is Fault.FORCE_LEFT  # nobody can know what the late write does
    device.close()
    assert not rig.last_n.any()
    late, closed = len(rig.written_n), rig.closed
    hang.set()
    wait_until(lambda: rig.closed > closed)
    assert rig.written_n[late][0] == pytest.approx(2.9, abs=0.2)  # the late one
    assert not rig.last_n.any()


def test_a_late_write_of_a_device_that_is_still_open_is_taken_back_too(device, rigs, rig, hang):
    hold(device, rigs, rig)
    rig.before_writing = in_loop(hang.wait)
    alive(device, 0.25)
    late = len(rig.written_n)
    hang.set()
    wait_until(lambda: len(rig.written_n) > late + 1)
    assert not rig.last_n.any()
    assert rig.closed == 0


def test_a_driver_that_comes_back_and_takes_no_zero_is_worse_than_lost(device, rigs, rig, hang):
    def fail(force_n) -> None:
        raise OSError("usb")

    hold(device, rigs, rig)
    rig.before_sensing = hang.wait
    alive(device, 0.2)
    assert device.fault() is Fault.LOST
    rig.before_writing = fail
    hang.set()
    wait_until(lambda: device.fault() is Fault.FORCE_LEFT)


def test_a_rig_that_was_given_up_gets_no_force_even_from_a_tick_that_was_under_way(rigs, rig):
    governor = Governor(rig.info, rigs.SETTINGS)
    runner = SteppedRunner(rig, governor, catches_up=False)
    governor.begin_hold(rigs.push())
    runner.run(20)
    runner.give_up(OSError("usb"))
    governor.state[govern.PHASE] = govern.PLAYING  # as a tick leaves it that heard of nothing
    given = len(rig.written_n)
    runner.run(20)
    assert not runner.moving
    assert not np.any(rig.written_n[given:])
    runner.disconnect()


def test_nothing_begins_while_the_loop_is_being_closed(device, rigs, rig):
    device._drive._closing = True
    with pytest.raises(DeviceError, match="cannot do this now"):
        device.hold(rigs.push())
    assert rig.written_n == []


def test_a_driver_that_hangs_with_its_lock_hangs_nobody_else(device, rigs, rig, hang):
    hold(device, rigs, rig)
    lock = threading.Lock()

    def sense() -> None:
        with lock:
            hang.wait()

    def write(force_n) -> None:
        with lock:
            pass

    rig.before_sensing, rig.before_writing = sense, write
    time.sleep(0.02)
    started_s = time.monotonic()
    assert device.release().health.fault is Fault.FORCE_LEFT
    with pytest.raises(DeviceError, match="Let go of the handle and switch the device off"):
        device.hold(rigs.push())
    device.close()
    assert time.monotonic() - started_s < 1.5
    hang.set()
    wait_until(lambda: not rig.last_n.any())


def test_writes_that_fail_for_good_are_not_called_a_force_that_is_off(device, rigs, rig):
    def fail(force_n) -> None:
        raise OSError("usb")

    hold(device, rigs, rig)
    rig.before_writing = fail
    alive(device, 0.1)
    assert device.fault() is Fault.FORCE_LEFT
    device.stop()
    assert device.fault() is Fault.FORCE_LEFT  # a stop does not hide it
    device.release()
    advice = r"usb\)\. It took no zero force.*force may still be on\. Let go of the handle and switch the device off"
    with pytest.raises(DeviceError, match=advice):
        device.hold(rigs.push())


@pytest.mark.parametrize("clock", [VirtualClock(), RealClock()], ids=["virtual", "real"])
def test_a_final_zero_that_fails_does_not_close_a_trial_without_fault(rigs, rig, clock):
    def fail_at_the_end(force_n) -> None:
        if not device._governor.moving:
            time.sleep(0.02)  # as long as that, all seems over
            raise OSError("usb")

    with contextlib.closing(SafeDevice(rig, rigs.SETTINGS, clock)) as device:
        device.hold(rigs.push())
        clock.sleep(0.2)
        rig.before_writing = fail_at_the_end
        assert device.release().health.fault is Fault.FORCE_LEFT


@pytest.mark.parametrize("clock", [VirtualClock(), RealClock()], ids=["virtual", "real"])
def test_a_zero_that_fails_while_the_force_fades_leaves_it_on_and_says_so(rigs, rig, clock):
    def fail_at_zero(force_n) -> None:
        if not force_n.any():
            raise OSError("usb")

    with contextlib.closing(SafeDevice(rig, rigs.SETTINGS, clock)) as device:
        device.hold(rigs.push())
        clock.sleep(0.2)
        rig.before_writing = fail_at_zero
        assert device.release().health.fault is Fault.FORCE_LEFT
        assert rig.last_n.any()


class TreacherousClock(RealClock):
    """Ends the haptic loop, outside of any tick."""

    def __init__(self) -> None:
        self.treacherous = False

    def now_s(self) -> float:
        if self.treacherous and threading.current_thread().name == "haptic loop":
            raise SystemExit
        return super().now_s()


def test_a_loop_that_dies_between_two_ticks_leaves_no_force(rigs, rig):
    clock = TreacherousClock()
    with contextlib.closing(SafeDevice(rig, rigs.SETTINGS, clock)) as device:
        hold(device, rigs, rig)
        clock.treacherous = True
        wait_until(lambda: device.fault() is Fault.LOST)
        assert not rig.last_n.any()
        assert device.release().health.fault is Fault.LOST
        with pytest.raises(DeviceError, match="SystemExit"):
            device.hold(rigs.push())


def test_a_driver_that_ends_the_loop_is_lost(device, rigs, rig):
    def leave() -> None:
        raise SystemExit

    hold(device, rigs, rig)
    rig.before_sensing = leave
    wait_until(lambda: not rig.last_n.any())
    rig.before_sensing = None
    device.release()
    with pytest.raises(DeviceError, match="SystemExit"):
        device.hold(rigs.push())


@pytest.mark.parametrize("kind", ["HeldForceRig", "compiled_rig"])
def test_a_loop_that_is_dead_plays_nothing(rigs, kind):
    with contextlib.closing(SafeDevice(getattr(rigs, kind)(), rigs.SETTINGS, RealClock())) as device:
        drive = device._drive
        drive.close()
        drive._closing = False
        with pytest.raises(DeviceError, match="its loop hangs"):
            device.hold(rigs.push())


@pytest.mark.parametrize("kind", ["HeldForceRig", "compiled_rig"])
def test_a_loop_that_dies_without_a_word_is_found_by_its_callers(rigs, kind):
    with contextlib.closing(SafeDevice(getattr(rigs, kind)(), rigs.SETTINGS, RealClock())) as device:
        device.hold(rigs.push())
        device._drive._thread = threading.Thread()  # never started, so not alive
        device.keep_alive()
        assert device.fault() is Fault.LOST
        device._drive._thread.start()


def test_a_second_start_is_refused_where_the_ticks_run(rigs, rig, device):
    device.hold(rigs.push())
    alive(device, 0.1)
    device._held = None  # as another thread sees it, which looked a moment earlier
    with pytest.raises(DeviceError, match="still playing"):
        device.hold(rigs.push(-2.9))
    with pytest.raises(DeviceError, match="still playing"):
        device.play(rigs.force(np.zeros((10, 3))))
    alive(device, 0.05)
    assert rig.last_n[0] == pytest.approx(2.9)
    assert rigs.violations(np.array(rig.written_n), rigs.LIMITS) == []


def test_two_threads_that_hold_at_once_do_not_break_the_slew_limit(rigs, rig, device):
    slow = rigs.HeldStimulus(rigs.force(np.tile([[-2.9, 0.0, 0.0]], (1_000_000, 1))), 0.05, 0.05, "linear")
    refused = []

    def hold(stimulus) -> None:
        try:
            device.hold(stimulus)
        except DeviceError as error:
            refused.append(error)

    threads = [threading.Thread(target=hold, args=(stimulus,)) for stimulus in (slow, rigs.push())]
    for thread in threads:
        thread.start()
        time.sleep(0.01)
    while any(thread.is_alive() for thread in threads):
        alive(device, 0.02)
    alive(device, 0.1)
    assert len(refused) == 1
    assert rigs.violations(np.array(rig.written_n), rigs.LIMITS) == []


class ImpatientClock(RealClock):
    """Every sleep of the main thread is interrupted, from a certain moment on."""

    def __init__(self) -> None:
        self.impatient = False

    def sleep(self, seconds: float) -> None:
        if self.impatient and threading.current_thread() is threading.main_thread():
            raise KeyboardInterrupt
        super().sleep(seconds)


def test_a_close_that_is_interrupted_turns_the_force_off_and_can_be_made_good_for(rigs, rig):
    clock = ImpatientClock()
    device = SafeDevice(rig, rigs.SETTINGS, clock)
    hold(device, rigs, rig)
    clock.impatient = True
    with pytest.raises(KeyboardInterrupt):
        device.close()
    assert not rig.last_n.any()
    assert rig.closed == 1
    with pytest.raises(DeviceError, match="is closed"):
        device.hold(rigs.push())
    assert device._closed is False  # so that it is closed once more when the program ends
    clock.impatient = False
    device.close()
    assert device._closed


def test_a_close_that_is_interrupted_once_more_while_the_loop_ends_disconnects_all_the_same(rigs, rig):
    def interrupt() -> None:
        raise KeyboardInterrupt

    device = SafeDevice(rig, rigs.SETTINGS, RealClock())
    hold(device, rigs, rig)
    device._drive.close = interrupt
    with pytest.raises(KeyboardInterrupt):
        device.close()
    assert rig.closed == 1
    assert not rig.last_n.any()
    del device._drive.close
    device.close()


def test_an_interruption_while_a_recording_lets_go_stops_at_once(rigs, rig):
    clock = ImpatientClock()

    def interrupt(share: float) -> None:
        if share > 0.6:
            clock.impatient = True
            raise KeyboardInterrupt

    with contextlib.closing(SafeDevice(rig, rigs.SETTINGS, clock)) as device:
        with pytest.raises(KeyboardInterrupt):
            device.play(rigs.force(np.minimum(np.arange(2000) * 0.01, 2.9)[:, None] * [1.0, 0.0, 0.0]), interrupt)
        clock.impatient = False
        assert device.fault() is Fault.STOPPED
        wait_until(lambda: not rig.last_n.any(), 1.0)


PROGRAM = """
import os, struct, sys, time
sys.path.insert(0, {tests!r})
import rigs
from study.devices.clock import RealClock
from study.devices.safe import SafeDevice

class Witness(rigs.HeldForceRig):
    # The file is the device: one system call writes a whole force or none.
    file = os.open({path!r}, os.O_CREAT | os.O_WRONLY)

    def write(self, force_n):
        super().write(force_n)
        os.pwrite(self.file, struct.pack("d", force_n[0]), 0)

device = SafeDevice(Witness(), rigs.SETTINGS, RealClock())
device.hold(rigs.push())
for k in range({naps}):
    device.keep_alive()
    time.sleep(0.02)
    if k == 10:
        print("held", flush=True)
"""


def program(tmp_path, naps: int) -> tuple[subprocess.Popen, Path]:
    path = tmp_path / "force"
    code = PROGRAM.format(tests=str(TESTS), path=str(path), naps=naps)
    process = subprocess.Popen(
        [sys.executable, "-c", code], cwd=TESTS.parent, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "held\n"
    return process, path


def force_left_n(path: Path) -> float:
    (force_n,) = struct.unpack("d", path.read_bytes())
    return float(force_n)


def test_a_program_that_ends_without_closing_leaves_no_force(tmp_path):
    process, path = program(tmp_path, naps=12)
    with process:
        assert process.wait(20) == 0
    assert force_left_n(path) == 0.0


def test_a_program_that_is_interrupted_again_and_again_leaves_no_force(tmp_path):
    process, path = program(tmp_path, naps=1000)
    with process:
        # Eight at least, and more as long as it runs: on a busy machine many arrive as one, and Python drops one that
        # comes while it tidies up.
        for number in range(1000):
            if number >= 8 and process.poll() is not None:
                break
            process.send_signal(signal.SIGINT)
            time.sleep(0.01)
        process.wait(20)
    assert force_left_n(path) == 0.0
