"""The safe device as its callers see it, and real time with a clock that a test moves."""

import threading
import time
from dataclasses import replace

import numpy as np
import pytest

from equalizer.signals.signal import Signal
from study.devices.clock import RealClock, VirtualClock
from study.devices.device import Fault
from study.devices.drive.realtime_drive import RealtimeDrive
from study.devices.drive.runner import CompiledRunner
from study.devices.drive.stepped_runner import SteppedRunner
from study.devices.governor.governor import Governor
from study.devices.safe import SafeDevice
from study.errors import DeviceError, ExitCode


@pytest.fixture
def clock():
    return VirtualClock()


@pytest.fixture
def rig(rigs):
    return rigs.compiled_rig()


@pytest.fixture
def device(rigs, rig, clock):
    device = SafeDevice(rig, rigs.SETTINGS, clock)
    yield device
    device.close()


def feel(device, clock, seconds: float) -> None:
    for _ in range(round(seconds / 0.1)):
        clock.sleep(0.1)
        device.keep_alive()


def test_the_steady_part_is_kept_in_whole_loops_of_what_was_played(device, clock, rigs):
    device.hold(rigs.sine(2.0, periods_per_s=5, fade_s=0.1))
    feel(device, clock, 1.0)
    played = device.release()
    recording = played.recording
    assert len(recording) == 400  # two loops of 200 in the 500 that may be kept
    shift = (1000 - 400) % 200
    assert np.allclose(recording.excitation.samples[shift:200], rigs.sine(2.0).loop.samples[: 200 - shift])
    segment = recording.segments[0]
    assert (segment.start, segment.stop, segment.kind, segment.period) == (0, 400, "sine", 200)
    assert segment.amplitude == pytest.approx(2.0)
    assert played.health.fault is Fault.NONE


@pytest.fixture
def springless(rigs, rig, clock):
    device = SafeDevice(rig, replace(rigs.SETTINGS, spring_frequency_hz=0.0, spring_damping_n_s_per_m=0.0), clock)
    yield device
    device.close()


def test_an_onset_is_played_once_as_it_is_and_the_loop_follows(springless, clock, rigs, rig):
    loop = rigs.sine(2.0, periods_per_s=5)
    onset = rigs.force(np.linspace(0.0, 1.0, 150)[:, None] * [0.0, 0.0, 1.0])
    springless.hold(replace(loop, onset=onset))
    feel(springless, clock, 0.5)
    played = springless.release()
    commands = np.concatenate([onset.samples, loop.loop.samples, loop.loop.samples])[:500]
    assert np.allclose(rigs.written(rig)[:500], commands)
    assert len(played.recording) == 200  # one loop of 200 in the 350 that followed the onset
    assert played.recording.segments[0].period == 200


def test_a_release_within_an_onset_fades_it_out(springless, clock, rigs, rig):
    springless.hold(replace(rigs.sine(2.0), onset=rigs.force(np.full((400, 3), [0.0, 0.0, 0.01]))))
    feel(springless, clock, 0.2)
    assert springless.release().recording is None
    written = rigs.written(rig)
    assert np.allclose(written[:200, 2], 0.01) and (np.diff(written[200:, 2]) <= 0).all() and written[-1, 2] == 0.0


def test_command_is_what_the_rig_got_and_readings_were_taken_just_before(device, clock, rigs, rig):
    device.hold(rigs.sine(2.0))
    feel(device, clock, 1.0)
    played = device.release()
    command = played.recording.command.samples
    start = next(k for k in range(2000) if (rigs.written(rig)[k : k + 400] == command).all())
    assert start == 600
    assert np.allclose(np.diff(command - played.recording.excitation.samples, axis=0), 0, atol=0.1)
    velocity = np.diff(played.recording.position.samples, axis=0) * 1000
    predicted = (command[:-1][1:] - 2.0 * velocity[:-1]) / rigs.MASS_KG
    assert np.allclose(played.truth.samples[2:], predicted, atol=1e-6)
    assert (played.truth.samples == played.recording.response.samples).all()


def test_a_loop_longer_than_what_is_kept_leaves_its_last_part(device, clock, rigs):
    device.hold(rigs.sine(1.0, periods_per_s=1))
    feel(device, clock, 1.0)
    assert len(device.release().recording) == 500


def test_what_never_became_steady_has_no_recording(device, clock, rigs):
    device.hold(rigs.sine(1.0, fade_s=0.3))
    feel(device, clock, 0.4)
    played = device.release()
    assert played.recording is None
    assert played.health.fault is Fault.NONE


def test_release_waits_until_the_force_is_off(device, clock, rigs, rig):
    device.hold(rigs.sine(2.0, fade_s=0.1))
    feel(device, clock, 0.5)
    before_s = clock.now_s()
    device.release()
    assert 0.1 <= clock.now_s() - before_s < 0.12
    assert not rigs.written(rig)[-1].any()


def test_while_nothing_is_held_nothing_is_simulated(device, clock, rigs, rig):
    clock.sleep(100.0)
    assert len(rigs.written(rig)) == 0


def test_compiled_and_stepped_rigs_are_driven_bit_for_bit_alike(rigs):
    results = []
    for rig in (rigs.compiled_rig(), rigs.ScriptedRig()):
        clock = VirtualClock()
        device = SafeDevice(rig, rigs.SETTINGS, clock)
        device.hold(rigs.sine(2.5, 25))
        feel(device, clock, 0.8)
        first = device.release().recording
        second = device.play(rigs.force(np.tile(rigs.sine(1.0).loop.samples, (3, 1)))).recording
        device.close()
        bare = rig if hasattr(rig, "state") else rig.mass
        results.append((first, second, rigs.written(bare)))
    (first, second, forces), (other_first, other_second, other_forces) = results
    assert (forces == other_forces[: len(forces)]).all()
    for one, other in ((first, other_first), (second, other_second)):
        for name in ("command", "response", "position", "excitation"):
            assert (getattr(one, name).samples == getattr(other, name).samples).all()


def test_sleeping_in_other_portions_changes_nothing(rigs):
    results = []
    for nap in (0.001, 0.0173, 0.25):
        clock, rig = VirtualClock(), rigs.compiled_rig()
        device = SafeDevice(rig, rigs.SETTINGS, clock)
        device.hold(rigs.sine(2.0))
        while clock.now_s() + nap < 1.0:
            clock.sleep(nap)
            device.keep_alive()
        clock.sleep(1.0 - clock.now_s())
        results.append(rigs.written(rig)[:1000])
        device.close()
    assert (results[0] == results[1]).all()
    assert (results[0] == results[2]).all()


def test_play_records_every_sample_of_what_was_asked(device, rigs):
    commands = rigs.force(np.tile(rigs.sine(2.0).loop.samples, (5, 1)))
    shares = []
    played = device.play(commands, shares.append)
    assert len(played.recording) == 1000
    assert np.allclose(played.recording.excitation.samples, commands.samples, atol=1e-12)
    assert played.recording.segments == ()
    assert shares == sorted(shares)
    assert shares[0] == 0.0
    assert shares[-1] == 1.0


def test_a_recording_may_be_longer_than_the_longest_trial_and_the_watchdog(device, rigs):
    commands = rigs.force(np.zeros((25_000, 3)))
    assert len(device.play(commands).recording) == 25_000


def test_the_spring_is_settled_when_a_recording_begins(device, rigs, rig):
    rig.parameters[1] = 20.0
    rig.state[0] = 0.01
    recording = device.play(rigs.force(np.zeros((100, 3)))).recording
    assert abs(recording.command.samples).max() < 0.3
    assert np.linalg.norm(rigs.written(rig), axis=1).max() > 0.5


def test_an_interruption_while_playing_lets_go_and_is_passed_on(device, rigs, rig):
    def interrupt(share: float) -> None:
        if share > 0.5:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        device.play(rigs.force(np.tile(rigs.sine(2.0).loop.samples, (10, 1))), interrupt)
    assert not rigs.written(rig)[-1].any()
    assert rigs.violations(rigs.written(rig), rigs.LIMITS) == []
    assert device.play(rigs.force(np.zeros((10, 3)))).recording is not None


def test_an_interruption_in_the_middle_of_a_tick_turns_the_force_off(rigs, clock):
    rig = rigs.ScriptedRig()
    device = SafeDevice(rig, rigs.SETTINGS, clock)
    device.hold(rigs.sine(2.0))
    feel(device, clock, 0.25)

    def interrupt() -> None:
        raise KeyboardInterrupt

    rig.instead_of_sensing = interrupt
    with pytest.raises(KeyboardInterrupt):
        clock.sleep(0.1)
    assert not rigs.written(rig.mass)[-1].any()
    assert device.fault() is Fault.STALLED
    device.close()


REFUSED = {
    "made for 500 Hz": lambda s: replace(s, loop=replace(s.loop, sample_rate_hz=500.0)),
    r"shape \(200, 2\)": lambda s: replace(s, loop=Signal(s.loop.samples[:, :2], 1000.0, "force", "N", ("fx", "fy"))),
    r"shape \(0, 3\)": lambda s: replace(s, loop=s.loop.part(0, 0)),
    "acceleration in m/s": lambda s: replace(s, loop=replace(s.loop, quantity="acceleration", unit="m/s^2")),
    "not numbers": lambda s: replace(s, loop=replace(s.loop, samples=s.loop.samples + np.nan)),
    "cap of the stimulus is 3 N": lambda s: replace(s, loop=replace(s.loop, samples=s.loop.samples * 3.01)),
    "slew limit is 1500 N/s": lambda s: replace(s, loop=replace(s.loop, samples=s.loop.samples[:150])),
    "cap of the stimulus": lambda s: replace(s, onset=replace(s.loop, samples=s.loop.samples * 3.01)),
    "limit is 1500 N/s": lambda s: replace(s, onset=replace(s.loop, samples=s.loop.samples * 0.0 + 1.6)),
    "fade_in_s is nan": lambda s: replace(s, fade_in_s=float("nan")),
    "fade_out_s is -1": lambda s: replace(s, fade_out_s=-1.0),
    "fade shape is 'square'": lambda s: replace(s, fade_shape="square"),
}


@pytest.mark.parametrize("why", REFUSED)
def test_a_stimulus_beyond_the_limits_is_refused_before_anything_moves(device, clock, rigs, rig, why):
    steep = rigs.sine(1.0)
    if "slew" in why:
        steep = replace(steep, loop=replace(steep.loop, samples=steep.loop.samples * 2))
    with pytest.raises(DeviceError, match=why) as refusal:
        device.hold(REFUSED[why](steep))
    assert "Nothing has moved" in str(refusal.value)
    feel(device, clock, 0.2)
    assert len(rigs.written(rig)) == 0


def test_commands_that_start_with_a_jump_are_refused(device, rigs):
    with pytest.raises(DeviceError, match="slew limit"):
        device.play(rigs.force(np.full((100, 3), 1.5)))


def test_a_second_hold_before_a_release_is_refused(device, rigs):
    device.hold(rigs.sine())
    with pytest.raises(DeviceError, match="still playing"):
        device.hold(rigs.sine())


def test_a_release_of_nothing_is_refused(device):
    with pytest.raises(DeviceError, match="Nothing is held"):
        device.release()


def test_a_stopped_device_plays_nothing_until_it_is_opened_again(device, clock, rigs, rig):
    device.hold(rigs.sine(3.0))
    feel(device, clock, 0.5)
    device.stop()
    assert device.fault() is Fault.STOPPED
    assert device.release().health.fault is Fault.STOPPED
    assert not rigs.written(rig)[501:].any()
    with pytest.raises(DeviceError, match="emergency stop"):
        device.hold(rigs.sine())
    with pytest.raises(DeviceError, match="emergency stop"):
        device.play(rigs.sine().loop)


def test_a_closed_device_plays_nothing_and_may_be_closed_twice(device, rigs):
    device.close()
    device.close()
    with pytest.raises(DeviceError, match="is closed"):
        device.hold(rigs.sine())


def test_closing_lets_go_first(device, clock, rigs, rig):
    device.hold(rigs.sine(3.0))
    feel(device, clock, 0.5)
    device.close()
    assert not rigs.written(rig)[-1].any()
    assert rigs.violations(rigs.written(rig), rigs.LIMITS) == []


@pytest.mark.parametrize(
    ("where", "fault", "advice"),
    [
        ("instead_of_sensing", Fault.LOST, r"Its force is off\. Check its power and its cable"),
        ("instead_of_writing", Fault.FORCE_LEFT, r"may still be on\. Let go of the handle and switch the device off"),
    ],
)
def test_a_rig_that_fails_is_lost_and_the_next_call_says_what_to_do(rigs, clock, where, fault, advice):
    def fail() -> None:
        raise OSError("cable pulled")

    rig = rigs.ScriptedRig()
    device = SafeDevice(rig, rigs.SETTINGS, clock)
    device.hold(rigs.sine(2.0))
    feel(device, clock, 0.4)
    setattr(rig, where, fail)
    feel(device, clock, 0.4)
    assert device.fault() is fault
    assert device.release().health.fault is fault
    with pytest.raises(DeviceError, match=rf"lost.*cable pulled.*{advice}"):
        device.hold(rigs.sine())
    device.close()
    assert rig.closed


@pytest.mark.parametrize("declared_s", [0.0, -1.0, 1.5, float("inf"), float("nan")])
def test_a_real_device_that_holds_its_force_for_ever_is_not_given_into_a_hand(rigs, clock, declared_s):
    rig = rigs.ScriptedRig()
    rig.drops_force_after_s = declared_s
    with pytest.raises(
        DeviceError, match=r"no watchdog of its own.*drops_force_after_s is .*without a hand"
    ) as refusal:
        SafeDevice(rig, rigs.SETTINGS, clock)
    assert refusal.value.exit_code is ExitCode.DEVICE
    SafeDevice(rig, replace(rigs.SETTINGS, hand_on_handle=False), clock).close()


def test_a_simulated_world_needs_no_watchdog_in_its_hardware(rigs, clock):
    class Simulated(rigs.HeldForceRig):
        info = rigs.INFO

    rig = Simulated()
    rig.drops_force_after_s = 0.0
    SafeDevice(rig, rigs.SETTINGS, clock).close()


def test_a_reading_of_the_wrong_shape_counts_as_a_lost_device(rigs, clock):
    rig = rigs.ScriptedRig()
    device = SafeDevice(rig, rigs.SETTINGS, clock)
    rig.instead_of_sensing = lambda: np.zeros(4)
    with pytest.raises(DeviceError, match="shape"):
        device.play(rigs.sine().loop)
    device.close()


@pytest.mark.real_time
def test_a_caller_that_stalls_loses_the_force_in_real_time(rigs, rig):
    device = SafeDevice(rig, rigs.SETTINGS, RealClock())
    device.hold(rigs.sine(3.0, fade_s=0.05))
    time.sleep(0.15)
    assert np.linalg.norm(rigs.written(rig), axis=1).max() > 1.0
    time.sleep(rigs.LIMITS.watchdog_s + rigs.LIMITS.release_s + 0.25)
    assert device.fault() is Fault.STALLED
    assert not rigs.written(rig)[-1].any()
    assert rigs.violations(rigs.written(rig), rigs.LIMITS) == []
    assert device.release().health.fault is Fault.STALLED
    device.close()


@pytest.mark.real_time
def test_a_stepped_rig_is_played_in_real_time_and_stopped_from_another_thread(rigs):
    rig = rigs.ScriptedRig()
    device = SafeDevice(rig, rigs.SETTINGS, RealClock())
    device.hold(rigs.sine(2.0, fade_s=0.05))
    time.sleep(0.2)
    stopper = threading.Thread(target=device.stop)
    stopper.start()
    stopper.join()
    played = device.release()
    device.close()
    assert played.health.fault is Fault.STOPPED
    assert played.health.ticks > 100
    assert not rigs.written(rig.mass)[-1].any()
    assert rigs.violations(rigs.written(rig.mass), rigs.LIMITS) == []


class ParkedClock:
    """Real time that stands still for the haptic thread, so that a test alone pumps."""

    virtual = False

    def __init__(self) -> None:
        self.open = threading.Event()

    def now_s(self) -> float:
        return float("inf") if self.open.is_set() else 0.0

    def sleep(self, seconds: float) -> None:
        self.open.wait()

    def utc(self) -> str:
        return "2026-01-01T00:00:00+00:00"


@pytest.fixture
def hand_pumped(rigs):
    """The parts of a device in real time: rig, governor, and a drive that this test pumps."""
    drives = []

    def build(rig) -> tuple[Governor, RealtimeDrive]:
        clock = ParkedClock()
        governor = Governor(rig.info, rigs.SETTINGS)
        compiled = hasattr(rig, "state")
        runner = CompiledRunner(rig, governor, 50) if compiled else SteppedRunner(rig, governor, catches_up=False)
        drive = RealtimeDrive(runner, governor, clock, rigs.RATE_HZ, rigs.LIMITS.watchdog_s)
        drives.append((drive, clock))
        return governor, drive

    yield build
    for drive, clock in drives:
        clock.open.set()
        drive.close()


def test_a_process_that_stood_still_too_long_finds_its_force_off(rigs, hand_pumped):
    for rig in (rigs.compiled_rig(), rigs.ScriptedRig()):
        governor, drive = hand_pumped(rig)
        drive.start(lambda governor=governor: governor.begin_hold(rigs.sine(3.0)))
        for k in range(1, 201):
            drive.pump(k * 0.001)
        governor.sign_of_life()
        drive.pump(0.2 + rigs.LIMITS.watchdog_s + 0.01)
        assert governor.fault is Fault.STALLED
        assert not rigs.written(rig if hasattr(rig, "state") else rig.mass)[200:].any()


def test_a_simulated_world_catches_up_and_misses_nothing(rigs, rig, hand_pumped):
    governor, drive = hand_pumped(rig)
    drive.start(lambda: governor.begin_hold(rigs.sine(2.0)))
    for now_s in (0.003, 0.0301, 0.2, 0.2504):
        drive.pump(now_s)
    assert governor.health().missed_ticks == 0
    assert len(rigs.written(rig)) == 250


def test_a_real_world_misses_late_ticks_and_the_waveform_is_not_stretched(rigs, hand_pumped):
    rig = rigs.ScriptedRig()
    governor, drive = hand_pumped(rig)
    drive.start(lambda: governor.begin_hold(rigs.sine(2.0, fade_s=0.0)))
    for k in (*range(1, 50), *range(60, 101)):
        drive.pump(k * 0.001)
    assert governor.health().missed_ticks == 10
    assert len(rigs.written(rig.mass)) == 90
    excitation = governor.rows()[:, 3:6]
    assert len(excitation) == 100
    assert np.allclose(excitation[60:], rigs.sine(2.0).loop.samples[60:100])


def test_an_error_in_the_loop_itself_turns_the_force_off(rigs, clock):
    rig = rigs.ScriptedRig()
    device = SafeDevice(rig, rigs.SETTINGS, BrokenClock())
    device.hold(rigs.sine(2.0))
    deadline = time.monotonic() + 2.0
    while device.fault() is Fault.NONE and time.monotonic() < deadline:
        time.sleep(0.01)
    assert device.fault() is Fault.LOST
    with pytest.raises(DeviceError, match="clock failed"):
        device._must_be_there()
    device.close()


class BrokenClock(RealClock):
    """Fails in the haptic thread, once it has played for a while."""

    def now_s(self) -> float:
        if threading.current_thread().name == "haptic loop" and time.monotonic() > self.until_s:
            raise OSError("clock failed")
        return time.monotonic()

    def __init__(self) -> None:
        self.until_s = time.monotonic() + 0.2
