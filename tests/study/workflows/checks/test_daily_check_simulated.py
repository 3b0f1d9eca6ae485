"""The comparison of two days on the simulated omega.3: its coupled axes, its modes, its accelerometer's noise."""

import contextlib
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from equalizer.signals.recording import Recording
from equalizer.signals.signal import Signal
from study.devices.clock import VirtualClock
from study.devices.safe import SafeDevice
from study.devices.simulated.omega3 import build_omega3
from study.devices.simulated.packing import pack_parameters
from study.devices.simulated.parameters import Omega3Parameters
from study.errors import DeviceError
from study.store.formats.protocol_files import read_recording_protocol
from study.store.formats.recording_file import read_recording
from study.workflows.checks.daily_check import compare_recordings
from study.workflows.recording.record_device import RecordingPlan, make_recording_settings, record_on_device
from tests.slow_instances import slow

NEW = Omega3Parameters()
CENTRE_M = (0.0, 0.0, 0.0)
WORN = {
    "friction": replace(NEW, drives=replace(NEW.drives, friction_n_m=2 * NEW.drives.friction_n_m)),
    "response": replace(NEW, mount=replace(NEW.mount, frequencies_hz=(18.0, 26.6))),
    "gain": replace(NEW, masses=replace(NEW.masses, handle_kg=NEW.masses.handle_kg + 0.06)),
    "noise": replace(NEW, accelerometer=replace(NEW.accelerometer, noise_g_per_rthz=(450e-6, 450e-6, 900e-6))),
}


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """Each device on each day once: tests change copies."""
    folder = tmp_path_factory.mktemp("days")

    @cache
    def record(seed: int, parameters: Omega3Parameters = NEW) -> Recording:
        rig = replace(build_omega3(seed, hand=False), parameters=pack_parameters(parameters, False, CENTRE_M))
        out = folder / f"{len(list(folder.iterdir()))}.h5"
        plan = RecordingPlan(read_recording_protocol("daily_check").protocol, "simulated", CENTRE_M, seed, out)
        with contextlib.closing(SafeDevice(rig, make_recording_settings(plan), VirtualClock())) as device:
            assert record_on_device(device, plan, lambda done: None).warnings == ()
        return read_recording(plan.out)

    return record


def changed(baseline: Recording, today: Recording) -> set[str]:
    return {change.kind for change in compare_recordings(baseline, today) if change.changed}


@pytest.mark.slow
@pytest.mark.parametrize("seeds", [range(2, 4), range(2, 32)])
def test_another_day_of_the_same_device_passes(recorded, seeds):
    baseline = recorded(1)
    assert [seed for seed in seeds if changed(baseline, recorded(seed))] == []


@pytest.mark.parametrize("kind", ["friction", *slow("noise", "gain", "response")])
def test_what_changed_at_the_device_is_named(recorded, kind):
    found = changed(recorded(1), recorded(2, WORN[kind]))
    assert kind in found
    assert kind == "noise" or "noise" not in found


def missed(recording: Recording, share: float, seed: int) -> Recording:
    """With so many of its ticks missed, one at a time."""
    gone = np.random.default_rng(seed).random(len(recording)) < share

    def holed(signal: Signal) -> Signal:
        return replace(signal, samples=np.where(gone[:, None], np.nan, signal.samples))

    assert recording.position is not None and recording.excitation is not None
    return replace(
        recording,
        command=holed(recording.command),
        response=holed(recording.response),
        position=holed(recording.position),
        excitation=holed(recording.excitation),
    )


@pytest.mark.slow
@pytest.mark.parametrize("seed", [5])
def test_a_few_missed_ticks_change_nothing_and_many_are_refused(recorded, seed):
    baseline, today = recorded(1), recorded(2)
    assert changed(baseline, missed(today, 0.01, seed)) == set()
    assert "friction" in changed(baseline, missed(recorded(3, WORN["friction"]), 0.01, seed))
    with pytest.raises(DeviceError, match="% of the samples of the command are missing"):
        compare_recordings(baseline, missed(today, 0.05, seed))
    no_sensor = replace(today.response, samples=np.full_like(today.response.samples, np.nan))
    with pytest.raises(DeviceError, match="100.0 % of the samples of the response are missing"):
        compare_recordings(baseline, replace(today, response=no_sensor))


def shaken(recording: Recording, rms_mps2: float, seed: int) -> Recording:
    """Under a sensor that is disturbed while the handle moves, and at rest not."""
    random = np.random.default_rng(seed)
    samples = recording.response.samples.copy()
    for segment in recording.segments:
        there = slice(segment.start, segment.stop)
        samples[there] += rms_mps2 * random.standard_normal(samples[there].shape)
    return replace(recording, response=replace(recording.response, samples=samples))


@pytest.mark.parametrize("seed", [6])
def test_what_noise_hides_is_not_called_a_change_and_not_fine(recorded, seed):
    found = compare_recordings(recorded(1), shaken(recorded(2), 2.0, seed))
    assert not any(change.changed for change in found)
    assert {change.kind for change in found if change.unclear} >= {"response"}
