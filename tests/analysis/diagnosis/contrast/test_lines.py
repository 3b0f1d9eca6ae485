"""Hum, noise and steps that a device has and its clean recordings lack are seen by their spectrum."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.diagnosis.contrast.lines import hum_of, noise_of, steps_of
from analysis.diagnosis.contrast.taken import taken_of


def test_a_line_of_the_mains_is_seen_where_the_clean_recording_has_none(rig):
    clean = taken_of([rig.recording(1)])
    found = hum_of(taken_of([rig.recording(2, "mains_hum", 2e-5)]), clean)
    assert found is not None
    assert found.values == {"frequency": pytest.approx(50.0, abs=0.1), "amplitude": pytest.approx(2e-5, rel=0.2)}
    assert hum_of(taken_of([rig.recording(2)]), clean) is None


def test_white_noise_is_seen_where_the_clean_recording_has_less(rig):
    clean = taken_of([rig.recording(1)])
    found = noise_of(taken_of([rig.noisy(2e-5)]), clean)
    assert found is not None
    assert found.values == {"rms": pytest.approx(2e-5, rel=0.1)}
    assert noise_of(taken_of([rig.recording(2)]), clean) is None


def test_what_is_only_louder_at_times_or_at_some_frequencies_is_no_noise_of_the_sensor(rig):
    clean, plain = taken_of([rig.recording(1)]), rig.noisy(2e-5)
    half = np.where(
        np.arange(rig.COUNT)[:, None] < rig.COUNT // 2, rig.recording(2).response.samples, plain.response.samples
    )
    assert noise_of(taken_of([replace(plain, response=replace(plain.response, samples=half))]), clean) is None
    steep = rig.recording(2).response.samples + 2e-5 * np.diff(
        np.random.default_rng(9).normal(size=(rig.COUNT + 6, 1)), 6, axis=0
    )
    assert noise_of(taken_of([replace(plain, response=replace(plain.response, samples=steep))]), clean) is None


def test_a_command_in_steps_is_seen_where_the_clean_one_has_none(rig):
    clean, plain = taken_of([rig.recording(1)]), rig.recording(2)
    stepped = replace(plain, command=replace(plain.command, samples=0.1 * np.round(plain.command.samples / 0.1)))
    found = steps_of(taken_of([stepped]), clean)
    assert found is not None
    assert (found.place, found.values) == ("actuator", {"step": pytest.approx(0.1)})
    assert steps_of(taken_of([plain]), clean) is None
    assert steps_of(taken_of([stepped]), taken_of([stepped])) is None
