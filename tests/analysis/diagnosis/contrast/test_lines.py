"""Hum, noise and steps that a device has and its clean recordings lack are seen by their spectrum."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.diagnosis.contrast.part import split_into_parts
from analysis.diagnosis.contrast.signal_faults import find_hum, find_quantization, find_sensor_noise


def test_a_line_of_the_mains_is_seen_where_the_clean_recording_has_none(rig):
    clean = split_into_parts([rig.recording(1)])
    found = find_hum(split_into_parts([rig.recording(2, "mains_hum", 2e-5)]), clean)
    assert found is not None
    assert found.values == {"frequency": pytest.approx(50.0, abs=0.1), "amplitude": pytest.approx(2e-5, rel=0.2)}
    assert find_hum(split_into_parts([rig.recording(2)]), clean) is None


def test_white_noise_is_seen_where_the_clean_recording_has_less(rig):
    clean = split_into_parts([rig.recording(1)])
    found = find_sensor_noise(split_into_parts([rig.noisy(2e-5)]), clean)
    assert found is not None
    assert found.values == {"rms": pytest.approx(2e-5, rel=0.1)}
    assert find_sensor_noise(split_into_parts([rig.recording(2)]), clean) is None


def test_what_is_only_louder_at_times_or_at_some_frequencies_is_no_noise_of_the_sensor(rig):
    clean, plain = split_into_parts([rig.recording(1)]), rig.noisy(2e-5)
    half = np.where(
        np.arange(rig.COUNT)[:, None] < rig.COUNT // 2, rig.recording(2).response.samples, plain.response.samples
    )
    assert (
        find_sensor_noise(split_into_parts([replace(plain, response=replace(plain.response, samples=half))]), clean)
        is None
    )
    steep = rig.recording(2).response.samples + 2e-5 * np.diff(
        np.random.default_rng(9).normal(size=(rig.COUNT + 6, 1)), 6, axis=0
    )
    assert (
        find_sensor_noise(split_into_parts([replace(plain, response=replace(plain.response, samples=steep))]), clean)
        is None
    )


def test_a_command_in_steps_is_seen_where_the_clean_one_has_none(rig):
    clean, plain = split_into_parts([rig.recording(1)]), rig.recording(2)
    stepped = replace(plain, command=replace(plain.command, samples=0.1 * np.round(plain.command.samples / 0.1)))
    found = find_quantization(split_into_parts([stepped]), clean)
    assert found is not None
    assert (found.place, found.values) == ("actuator", {"step": pytest.approx(0.1)})
    assert find_quantization(split_into_parts([plain]), clean) is None
    assert find_quantization(split_into_parts([stepped]), split_into_parts([stepped])) is None
