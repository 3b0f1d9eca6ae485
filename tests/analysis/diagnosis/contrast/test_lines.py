"""Hum, noise and steps that a device has and its clean recordings lack are seen by their spectrum."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.diagnosis.contrast.recording_part import split_into_parts
from analysis.diagnosis.contrast.signal_faults import find_hum, find_quantization, find_sensor_noise
from equalizer.signals.recording import Recording
from equalizer.signals.signal import Signal


def test_a_line_of_the_mains_is_seen_where_the_clean_recording_has_none(rig):
    clean = split_into_parts([rig.record_rig(1)])
    found = find_hum(split_into_parts([rig.record_rig(2, "mains_hum", 2e-5)]), clean)
    assert found is not None
    assert found.values == {"frequency": pytest.approx(50.0, abs=0.1), "amplitude": pytest.approx(2e-5, rel=0.2)}
    assert find_hum(split_into_parts([rig.record_rig(2)]), clean) is None


@pytest.mark.parametrize("off_lines", [0.0, 0.25, 0.5])
def test_the_amplitude_of_hum_depends_neither_on_the_noise_nor_on_the_lines(off_lines):
    # A tone between two lines of the spectrum loses up to 1.4 dB at the larger of them.
    count, rate_hz = 20_000, 1000.0
    random = np.random.default_rng(5)
    time_s, hum_hz = np.arange(count) / rate_hz, 50.0 + off_lines * rate_hz / count

    def part_of(amplitude: float, rms: float):
        samples = amplitude * np.sin(2 * np.pi * hum_hz * time_s) + rms * random.standard_normal(count)
        driven = Signal(random.standard_normal((count, 1)), rate_hz, "force", "N", ("fx",))
        return split_into_parts(
            [Recording("d", driven, Signal(samples[:, None], rate_hz, "acceleration", "m/s^2", ("ax",)))]
        )

    for rms in (0.01, 1.0):
        found = find_hum(part_of(0.3, rms), part_of(0.0, rms))
        assert found is not None
        assert found.values["amplitude"] == pytest.approx(0.3, rel=0.01 if rms < 0.1 else 0.08)


def test_white_noise_is_seen_where_the_clean_recording_has_less(rig):
    clean = split_into_parts([rig.record_rig(1)])
    found = find_sensor_noise(split_into_parts([rig.add_noise(2e-5)]), clean)
    assert found is not None
    assert found.values == {"rms": pytest.approx(2e-5, rel=0.1)}
    assert find_sensor_noise(split_into_parts([rig.record_rig(2)]), clean) is None


def test_what_is_only_louder_at_times_or_at_some_frequencies_is_no_noise_of_the_sensor(rig):
    clean, plain = split_into_parts([rig.record_rig(1)]), rig.add_noise(2e-5)
    half = np.where(
        np.arange(rig.COUNT)[:, None] < rig.COUNT // 2, rig.record_rig(2).response.samples, plain.response.samples
    )
    assert (
        find_sensor_noise(split_into_parts([replace(plain, response=replace(plain.response, samples=half))]), clean)
        is None
    )
    steep = rig.record_rig(2).response.samples + 2e-5 * np.diff(
        np.random.default_rng(9).normal(size=(rig.COUNT + 6, 1)), 6, axis=0
    )
    assert (
        find_sensor_noise(split_into_parts([replace(plain, response=replace(plain.response, samples=steep))]), clean)
        is None
    )


def test_a_command_in_steps_is_seen_where_the_clean_one_has_none(rig):
    clean, plain = split_into_parts([rig.record_rig(1)]), rig.record_rig(2)
    stepped = replace(plain, command=replace(plain.command, samples=0.1 * np.round(plain.command.samples / 0.1)))
    found = find_quantization(split_into_parts([stepped]), clean)
    assert found is not None
    assert (found.place, found.values) == ("actuator", {"step": pytest.approx(0.1)})
    assert find_quantization(split_into_parts([plain]), clean) is None
    assert find_quantization(split_into_parts([stepped]), split_into_parts([stepped])) is None
