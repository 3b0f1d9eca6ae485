import numpy as np
import pytest

from analysis.diagnosis.data.find_segments import find_period
from analysis.look.repeats import check_repeats, find_repeats
from equalizer.signals.recording import Segment


def tile_noise(period, times, seed=1):
    return np.tile(np.random.default_rng(seed).standard_normal(period), times)


@pytest.mark.parametrize("period", [17, 400, 1237, 5000])
@pytest.mark.parametrize("times", [2.2, 5.5])
def test_the_period_of_a_noise_that_is_played_again_is_found(period, times):
    command = tile_noise(period, 6)[: int(period * times)]
    assert find_period(command[:, None]) == period


def test_the_period_of_three_channels_of_which_one_rests():
    command = np.column_stack([tile_noise(300, 4), np.zeros(1200), tile_noise(300, 4, seed=2)])
    assert find_period(command) == 300


@pytest.mark.parametrize(
    "command",
    [
        np.random.default_rng(1).standard_normal(4000),
        np.cumsum(np.random.default_rng(1).standard_normal(4000)),
        np.repeat([0.0, 1.0], 2000),
        np.sin(2 * np.pi * np.arange(4000) ** 2 / 4e5),
        np.arange(4000.0),
        np.ones(4000),
    ],
    ids=["noise", "random walk", "step", "sweep", "ramp", "constant"],
)
def test_what_does_not_repeat_has_no_period(command):
    assert find_period(command[:, None]) == 0


def test_an_undeclared_period_is_reported_with_the_noise_between_repeats(make_recording):
    command, rng = tile_noise(500, 8), np.random.default_rng(2)
    response = 3 * command + 0.3 * rng.standard_normal(len(command))
    found = make_recording(command, response)
    seen = find_repeats(found, [(0, len(found))])
    assert seen.undeclared_period == 500
    assert seen.noise[0].share[0] == pytest.approx(0.1, rel=0.1)
    levels = {check.level for check in check_repeats(found, seen)}
    assert levels == {"notice", "fine"}


def test_a_period_across_segments_that_only_split_fit_from_test_is_found(make_recording):
    command = tile_noise(700, 3)
    halves = (Segment(0, 1050, "noise", role="fit"), Segment(1050, 2100, "noise", role="test"))
    assert find_repeats(make_recording(command, command, segments=halves), [(0, 2100)]).undeclared_period == 700


def test_declared_periods_are_taken_and_checked(make_recording):
    command = tile_noise(500, 8)
    right = make_recording(command, command, segments=(Segment(0, 4000, "noise", period=500),))
    seen = find_repeats(right, [(0, 4000)])
    assert (seen.undeclared_period, seen.noise[0].periods, seen.noise[0].segment) == (0, 7, 1)
    assert {check.level for check in check_repeats(right, seen)} == {"fine"}
    wrong = make_recording(command, command, segments=(Segment(0, 4000, "noise", period=480),))
    (check, *_) = check_repeats(wrong, find_repeats(wrong, [(0, 4000)]))
    assert check.level == "wrong"
    assert "Segment 1 states a period of 480 samples, but its excitation differs by" in check.finding


def test_a_feedback_does_not_hide_that_the_excitation_repeats(make_recording):
    decided = tile_noise(500, 8)
    command = decided + 0.5 * np.random.default_rng(3).standard_normal(4000)
    assert find_repeats(make_recording(command, command, excitation=decided), [(0, 4000)]).undeclared_period == 500


def test_where_nothing_repeats_that_is_reported(make_recording):
    command = np.random.default_rng(1).standard_normal(3000)
    found = make_recording(command, command)
    (check,) = check_repeats(found, find_repeats(found, [(0, 3000)]))
    assert (check.level, "Nothing repeats" in check.finding) == ("notice", True)
