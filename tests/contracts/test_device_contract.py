"""What every device keeps to, behind the same safety layer."""

import contextlib
import runpy
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from equalizer.signals.joining import join_recordings
from study.devices.clock import VirtualClock
from study.devices.device import Fault
from study.devices.force_dimension.device_models import MODELS
from study.devices.opening import DEVICES, FRICTIONLESS, open_device
from study.devices.rigs_by_name import RIGS_BY_NAME
from study.devices.safe import SafeDevice
from study.errors import DeviceError
from study.store.formats.recording_file import write_recording

EXAMPLES = Path(__file__).parents[2] / "docs" / "examples"

KINDS = (
    "simulated omega.3",
    "compiled mass",
    "stepped mass",
    "driver on the stub",
    "driver behind pipes",
    "replay of a recording",
    "driver of the docs",
)
KIND_OF = {"simulated": KINDS[0], "simulated-frictionless": KINDS[0], **dict.fromkeys(MODELS, "driver on the stub")}
"""By which kind each name of `--device` is tested here."""


@pytest.fixture
def clock():
    return VirtualClock()


@pytest.fixture
def pressed():
    """Buttons that are held down, where the device has any."""
    return set()


@pytest.fixture(scope="module")
def recorded(rigs, tmp_path_factory):
    """What the simulated device answered to the stimuli of these tests."""
    played = []
    with contextlib.closing(open_device("simulated", rigs.SETTINGS, VirtualClock(), seed=4)) as device:
        for stimulus, loops in ((rigs.sine(1.0), 8), (rigs.sine(1.0, 25), 40), (rigs.sine(1.5, 10), 3)):
            commands = rigs.force(np.tile(stimulus.loop.samples, (loops, 1)))
            played.append(device.play(commands).recording)
    path = tmp_path_factory.mktemp("recorded") / "played.h5"
    write_recording(path, join_recordings(played, {}))
    return path


@pytest.fixture(params=KINDS)
def device(request, rigs, clock, pressed):
    if request.param == "simulated omega.3":
        opened = open_device("simulated", rigs.SETTINGS, clock, seed=3)
    elif request.param == "replay of a recording":
        opened = open_device(f"replay:{request.getfixturevalue('recorded')}", rigs.SETTINGS, clock, seed=3)
    elif request.param == "driver of the docs":
        example = runpy.run_path(str(EXAMPLES / "drive_own_device.py"))
        opened = SafeDevice(example["InventedRig"](example["InventedLibrary"]()), rigs.SETTINGS, clock)
    elif request.param == "driver on the stub":
        stub = request.getfixturevalue("stepped_stub")
        opened = SafeDevice(stub.rig(), rigs.SETTINGS, clock)
    elif request.param == "driver behind pipes":
        behind = SafeDevice(request.getfixturevalue("stepped_stub").rig(), rigs.SETTINGS, clock)
        opened = request.getfixturevalue("served").remote(behind, rigs.SETTINGS)
        opened._runner = behind._runner
    else:
        kind = rigs.compiled_rig if request.param == "compiled mass" else rigs.ScriptedRig
        rig = kind(pressed=pressed)
        opened = SafeDevice(rig, rigs.SETTINGS, clock)
    with contextlib.closing(opened):
        yield opened


def feel(device, clock, seconds: float) -> None:
    for _ in range(round(seconds / 0.1)):
        clock.sleep(0.1)
        device.keep_alive()


def test_each_driver_that_can_be_opened_is_tested_here():
    assert set(RIGS_BY_NAME) == {*DEVICES, FRICTIONLESS} == set(KIND_OF)
    assert set(KIND_OF.values()) <= set(KINDS)


def test_it_says_what_it_is(device):
    assert device.info.name
    assert device.info.sample_rate_hz == 1000.0
    assert device.info.max_force_n > 0
    assert device.info.effective_mass_kg > 0


def test_a_held_stimulus_is_played_until_it_is_released(device, clock, rigs):
    device.hold(rigs.sine(1.0))
    feel(device, clock, 2.0)
    assert device.fault() is Fault.NONE
    played = device.release()
    recording = played.recording
    assert len(recording) == 400
    assert recording.device == device.info.name
    assert recording.sample_rate_hz == device.info.sample_rate_hz
    assert recording.command.unit == recording.excitation.unit == "N"
    assert recording.response.unit == "m/s^2"
    assert recording.response.channels == ("ax", "ay", "az")
    assert recording.position.unit == "m"
    assert np.abs(recording.response.samples).max() > 0.5
    assert np.linalg.norm(recording.excitation.samples, axis=1).max() == pytest.approx(1.0)
    assert played.health.missed_ticks == played.health.stimulus_clipped == 0
    assert played.health.peak_command_n <= rigs.LIMITS.total_cap_n


def test_true_acceleration_is_reported_by_simulated_devices_only(device, rigs):
    played = device.play(rigs.sine(1.0).loop)
    assert (played.truth is not None) == device.info.simulated
    assert played.truth is None or np.isfinite(played.truth.samples).all()


def test_one_trial_follows_another(device, clock, rigs):
    for _ in range(3):
        device.hold(rigs.sine(1.0, 25))
        feel(device, clock, 0.8)
        assert device.release().recording is not None
        clock.sleep(5.0)


def test_without_signs_of_life_the_force_is_off(device, clock, rigs):
    device.hold(rigs.sine(1.0))
    clock.sleep(rigs.LIMITS.watchdog_s + rigs.LIMITS.release_s + 0.01)
    assert device.fault() is Fault.STALLED
    played = device.release()
    assert played.health.fault is Fault.STALLED
    assert played.health.ticks <= 1000 * (rigs.LIMITS.watchdog_s + rigs.LIMITS.release_s) + 2
    device.hold(rigs.sine(1.0))  # the next trial is a new one
    assert device.fault() is Fault.NONE


def test_a_stimulus_without_an_answer_is_released(device, clock, rigs):
    device.hold(rigs.sine(1.0))
    feel(device, clock, rigs.LIMITS.longest_hold_s + 0.5)
    assert device.release().health.fault is Fault.HELD_TOO_LONG


def test_commands_are_recorded_from_the_first_sample_to_the_last(device, rigs):
    commands = rigs.force(np.tile(rigs.sine(1.5, 10).loop.samples, (3, 1)))
    played = device.play(commands)
    assert len(played.recording) == 300
    assert np.allclose(played.recording.excitation.samples, commands.samples, atol=1e-9)
    assert np.isfinite(played.recording.response.samples).all()


def test_what_is_not_within_the_limits_is_refused(device, rigs):
    stimulus = rigs.sine(3.0)
    with pytest.raises(DeviceError, match="cap of the stimulus"):
        device.hold(replace(stimulus, loop=rigs.force(2 * stimulus.loop.samples)))
    with pytest.raises(DeviceError, match="cap of the stimulus"):
        device.play(rigs.force(2 * stimulus.loop.samples))


def test_a_stop_lasts_until_the_device_is_opened_again(device, clock, rigs):
    device.hold(rigs.sine(1.0))
    feel(device, clock, 0.5)
    device.stop()
    assert device.fault() is Fault.STOPPED
    assert device.release().health.fault is Fault.STOPPED
    with pytest.raises(DeviceError, match="emergency stop"):
        device.hold(rigs.sine(1.0))


def test_it_may_be_closed_at_any_time_and_twice(device, clock, rigs):
    device.hold(rigs.sine(1.0))
    feel(device, clock, 0.5)
    device.close()
    device.close()
    with pytest.raises(DeviceError, match="is closed"):
        device.hold(rigs.sine(1.0))


def test_an_idle_device_can_be_looked_at(device):
    look = device.look()
    assert np.linalg.norm(look.position_m) < 1e-3
    assert np.linalg.norm(look.acceleration_mps2) < 1.0
    assert (look.sensor_clipped, look.buttons, look.missed_ticks) == (False, frozenset(), 0)


def test_a_look_at_a_held_handle_follows_it(device, clock, rigs):
    device.hold(rigs.sine(1.0, periods_per_s=5, fade_s=0.0))
    looks = []
    for _ in range(40):
        clock.sleep(0.005)
        looks.append(device.look())
    assert np.ptp([look.position_m[2] for look in looks]) > 1e-4
    assert np.ptp([look.acceleration_mps2[2] for look in looks]) > 0.5
    assert all(look.missed_ticks == 0 for look in looks)


def test_a_look_right_after_a_stimulus_begins_has_a_reading(device, rigs):
    device.look()
    device.hold(rigs.sine(1.0))
    assert device.look().position_m is not None


def test_buttons_are_seen_whether_something_is_held_or_not(device, clock, rigs, pressed):
    has_buttons = device.info.name == "mass"
    pressed.add(0)
    assert device.look().buttons == ({0} if has_buttons else set())
    device.hold(rigs.sine(1.0))
    pressed.add(3)
    feel(device, clock, 0.1)
    assert device.look().buttons == ({0, 3} if has_buttons else set())
    pressed.clear()
    feel(device, clock, 0.1)
    assert device.look().buttons == set()


def test_a_look_at_a_device_that_is_lost_or_closed_has_no_reading(device, clock, rigs):
    device.hold(rigs.sine(1.0))
    feel(device, clock, 0.1)
    device._runner.give_up(OSError("usb"))
    lost = device.look()
    assert (lost.position_m, lost.acceleration_mps2, lost.sensor_clipped, lost.buttons) == (None, None, False, set())
    device.release()
    assert device.look() == lost
    device.close()
    assert device.look() == lost


def test_a_device_that_was_stopped_can_still_be_looked_at(device, clock, rigs):
    device.hold(rigs.sine(1.0))
    feel(device, clock, 0.5)
    device.stop()
    device.release()
    assert device.look().position_m is not None


def test_looking_changes_nothing_that_is_recorded(rigs):
    recordings = []
    for looks in (0, 25):
        clock = VirtualClock()
        with contextlib.closing(open_device("simulated", rigs.SETTINGS, clock, seed=8)) as device:
            for _ in range(looks):
                device.look()
            device.hold(rigs.sine(1.0))
            feel(device, clock, 1.0)
            for _ in range(looks):
                device.look()
            recordings.append(device.release().recording.response.samples)
    assert (recordings[0] == recordings[1]).all()


def test_the_same_seed_and_calls_give_the_same_recording(rigs):
    recordings = []
    for _ in range(2):
        clock = VirtualClock()
        with contextlib.closing(open_device("simulated", rigs.SETTINGS, clock, seed=8)) as device:
            device.hold(rigs.sine(1.0))
            feel(device, clock, 1.0)
            recordings.append(device.release().recording.response.samples)
    assert (recordings[0] == recordings[1]).all()
