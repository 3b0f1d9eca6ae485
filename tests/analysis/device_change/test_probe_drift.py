"""Concealed changes in mid-session are named with their number, and where nothing changes nothing is named."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.device_change.probe_drift import TimedProbe, find_drifts
from analysis.device_change.probe_lines import compute_probe_lines, estimate_apparent_mass_kg
from protocols.definition.probes import ProbeSettings
from study.session.stimulus.probe_stimulus import make_probe_wave
from tests.slow_instances import slow

LEVELS_N = (0.2, 0.4, 0.8)
WAVE = make_probe_wave(ProbeSettings(levels_n=LEVELS_N), 1000.0)


def with_response(recording, samples):
    return replace(recording, response=replace(recording.response, samples=samples))


@pytest.fixture
def session(drifting_device):
    """Probes once a minute: two of each level, then one of each after the change."""

    def probes(seed: int, **changes: float) -> list[TimedProbe]:
        device = drifting_device
        truths = [device.Truth()] * 6 + [device.make_truth(**changes)] * 3
        played = device.play(WAVE, truths, LEVELS_N * 3, seed)
        return [TimedProbe(60.0 * k, LEVELS_N[k % 3], compute_probe_lines(each, 1.0)) for k, each in enumerate(played)]

    return probes


@pytest.mark.parametrize("seed", [1, *slow(*range(2, 21))])
def test_where_nothing_changes_nothing_is_named(session, seed):
    assert find_drifts(session(seed), 1000) == ()


@pytest.mark.slow
def test_more_friction_is_named_on_every_axis_with_its_number_and_time(session):
    found = find_drifts(session(1, friction_n=0.2), 1000)
    assert {(each.cause, each.axis) for each in found} == {("friction", axis) for axis in "xyz"}
    for each in found:
        assert each.time_s == 480.0
        assert each.change == pytest.approx(0.08, abs=0.03)
        assert each.initial_value == pytest.approx(0.12, abs=0.03)
        assert each.rivals == ()


@pytest.mark.slow
@pytest.mark.parametrize("break_away_m", [1.5e-5, 3e-5])
def test_the_level_of_friction_is_right_between_the_lengths_that_are_tried(
    session, drifting_device, monkeypatch, break_away_m
):
    monkeypatch.setattr(drifting_device, "BRISTLE_M", break_away_m)
    found = find_drifts(session(1, friction_n=0.2), 1000)
    assert {(each.cause, each.axis) for each in found} == {("friction", axis) for axis in "xyz"}
    assert np.mean([each.change for each in found]) == pytest.approx(0.08, abs=0.015)
    assert np.mean([each.initial_value for each in found]) == pytest.approx(0.12, abs=0.02)


@pytest.mark.slow
def test_a_weaker_motor_is_a_gain_or_not_told_from_a_grip_and_says_so(session):
    found = find_drifts(session(1, gain=0.9), 1000)
    assert [(each.cause, each.axis) for each in found] == [("gain", axis) for axis in "xyz"]
    assert all(each.change == pytest.approx(-0.1, abs=0.02) for each in found)
    assert all(each.rivals in ((), ("grip",)) for each in found)


@pytest.mark.slow
def test_a_millisecond_of_delay_is_a_delay_and_nothing_else(session):
    (found,) = find_drifts(session(1, delay_ticks=1), 1000)
    assert found.cause == "delay"
    assert found.change == pytest.approx(1e-3, abs=1e-4)


@pytest.mark.slow
def test_a_lighter_grip_is_named_by_its_mass(session):
    found = find_drifts(session(1, hand_kg=0.045, hand_n_s_per_m=2.0, hand_n_per_m=60.0), 1000)
    masses = {each.axis: each.change for each in found if each.parameter == "mass"}
    assert {each.cause for each in found} == {"grip"}
    assert masses == pytest.approx({axis: -0.045 for axis in "xyz"}, abs=0.01)


@pytest.mark.slow
def test_a_firmer_grip_is_named_or_not_told_from_a_gain_and_says_so(session):
    found = find_drifts(session(1, hand_kg=0.135, hand_n_s_per_m=6.0, hand_n_per_m=180.0), 1000)
    assert found
    assert all(each.cause == "grip" or "grip" in each.rivals for each in found)


@pytest.mark.slow
def test_two_of_each_level_are_the_yardstick_and_name_nothing_by_themselves(session):
    assert find_drifts(session(1, friction_n=0.5)[:6], 1000) == ()
    assert find_drifts([], 1000) == ()


@pytest.mark.slow
def test_a_hand_adds_to_the_mass_that_the_handle_seems_to_have(drifting_device):
    free = drifting_device.make_truth(hand_kg=0.0, hand_n_s_per_m=0.0, hand_n_per_m=0.0)
    played = drifting_device.play(WAVE, [free, drifting_device.Truth()], (0.8, 0.8), seed=1)
    masses = [estimate_apparent_mass_kg(compute_probe_lines(each, 1.0)) for each in played]
    assert masses[1] - masses[0] == pytest.approx(0.09, abs=0.02)


def test_a_recording_without_a_whole_period_is_refused(drifting_device):
    (played,) = drifting_device.play(WAVE, [drifting_device.Truth()], (0.8,), seed=1)
    with pytest.raises(ValueError, match="less than one whole period"):
        compute_probe_lines(played, 2.0)
    torn = np.where(np.arange(len(played))[:, None] == 5, np.nan, played.response.samples)
    with pytest.raises(ValueError, match="missing"):
        compute_probe_lines(with_response(played, torn), 1.0)


@pytest.mark.parametrize("reading", [0.0, 9.81])
def test_a_sensor_of_which_an_axis_reads_the_same_all_the_time_is_refused(drifting_device, reading):
    """The mean over the axes hid it, and the comparison of probes ended with an error of linear algebra."""
    (played,) = drifting_device.play(WAVE, [drifting_device.Truth()], (0.8,), seed=1)
    samples = np.where([False, False, True], reading, played.response.samples)
    with pytest.raises(ValueError, match="does not follow the force: check the accelerometer and its cable"):
        compute_probe_lines(with_response(played, samples), 1.0)


def test_first_probes_without_any_difference_are_compared_too(session):
    """As of a replayed recording: there was no noise to divide by."""
    first, changed = session(1)[:3], session(1, friction_n=0.2)[6:]
    assert find_drifts([*first, *first, *first], 1000) == ()
    assert {drift.cause for drift in find_drifts([*first, *first, *changed], 1000)} == {"friction"}


def test_a_gap_in_the_excitation_is_refused(drifting_device):
    (played,) = drifting_device.play(WAVE, [drifting_device.Truth()], (0.8,), seed=1)
    samples = np.where(np.arange(len(played))[:, None] == 5, np.nan, played.command.samples)
    with pytest.raises(ValueError, match="missing"):
        compute_probe_lines(replace(played, excitation=replace(played.command, samples=samples)), 1.0)


def test_an_axis_that_no_line_drives_hides_no_change_of_the_others(session):
    probes = session(1, gain=0.9)
    for probe in probes:
        probe.lines.driven[:, 2] = False
    found = find_drifts(probes, 1000)
    assert {(each.cause, each.axis) for each in found} == {("gain", "x"), ("gain", "y")}
