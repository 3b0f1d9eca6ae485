import itertools

import numpy as np
import pytest

from analysis.look.channels import list_channels
from analysis.look.levels import check_proportionality, compute_segment_levels
from analysis.look.overview import check_resolution
from analysis.look.plausibility import check_offsets, check_units
from equalizer.signals.recording import SEGMENT_KINDS, Segment

TWO = (Segment(0, 10_000, "noise", 1.0), Segment(10_000, 20_000, "noise", 2.0))


def check_levels(found):
    channels = list_channels(found)
    return check_proportionality(compute_segment_levels(found, channels), channels)


@pytest.fixture
def two_levels(make_noise):
    return np.repeat([1.0, 2.0], 10_000) * np.tile(make_noise(n=10_000), 2)


def test_an_answer_in_proportion_is_fine(make_recording, two_levels):
    (check,) = check_levels(make_recording(two_levels, 3 * two_levels, segments=TWO))
    assert check.level == "fine"


def test_an_answer_that_falls_behind_is_reported_by_how_much(make_recording, two_levels):
    answer = np.concatenate([two_levels[:10_000], 0.5 * two_levels[10_000:]])
    (check,) = check_levels(make_recording(two_levels, answer, segments=TWO))
    assert check.level == "notice"
    assert "changes by −50 %" in check.finding


def test_one_level_says_nothing(make_recording, two_levels):
    same = (Segment(0, 5000, "noise", 1.0), Segment(5000, 10_000, "noise", 1.0))
    assert check_levels(make_recording(two_levels, two_levels, segments=same)) == ()


def test_axes_that_are_driven_in_turn_are_not_compared(make_recording, two_levels):
    turns = np.column_stack([two_levels, two_levels])
    turns[10_000:, 0] = turns[:10_000, 1] = 0.0
    assert check_levels(make_recording(turns, two_levels, segments=TWO)) == ()


@pytest.mark.parametrize(
    ("samples", "quantity", "unit", "level"),
    [
        (1.0, "position", "m", "fine"), (5e4, "position", "m", "wrong"), (1e-11, "position", "m", "wrong"),
        (5.0, "acceleration", "m/s^2", "fine"), (1e6, "acceleration", "m/s^2", "wrong"), (1.0, "1", "1", "notice"),
        (4000.0, "angle", "rad", "fine"),
    ],
)  # fmt: skip
def test_sizes_that_no_device_has_are_doubted(make_recording, make_noise, samples, quantity, unit, level):
    found = check_units(list_channels(make_recording(make_noise(), (samples * make_noise(seed=2), quantity, unit))))
    assert [check.level for check in found] == [level]


@pytest.mark.parametrize(("rest", "level"), [(1.0, "wrong"), (9.81, "fine"), (0.0, "fine")])
def test_an_accelerometer_in_g_is_recognised_by_gravity(make_recording, make_noise, rest, level):
    found = check_units(list_channels(make_recording(make_noise(), rest + 0.1 * make_noise(seed=2))))
    assert [check.level for check in found] == [level]


def test_offsets_are_reported_and_gravity_is_known(make_recording, make_noise):
    found = check_offsets(
        list_channels(make_recording(make_noise() - make_noise().mean() + 2.0, 9.81 + make_noise(seed=2)))
    )
    assert [check.level for check in found] == ["notice", "fine"]
    assert "The mean of command 'f1' is 2 N (" in found[0].finding
    assert "gravity" in found[1].finding
    assert check_offsets(list_channels(make_recording(make_noise(), make_noise(seed=2))))[0].level == "fine"


@pytest.mark.parametrize(("steps", "level"), [(0.8, "wrong"), (10.0, "notice"), (200.0, "fine")])
def test_the_step_of_a_converter_is_found(make_recording, make_noise, steps, level):
    step = 1.0 / steps
    (check,) = check_resolution(list_channels(make_recording(make_noise(), np.round(make_noise(seed=2) / step) * step)))
    assert check.level == level
    assert f"has a resolution of {step:.3g} m/s^2" in check.finding


def test_an_analog_channel_has_no_step(make_recording, make_noise):
    (check,) = check_resolution(list_channels(make_recording(make_noise(), make_noise(seed=2))))
    assert (check.level, check.finding) == ("fine", "No sensor is limited by the resolution of its converter.")


def test_of_two_kinds_as_frequent_the_first_is_compared(make_recording, two_levels):
    """A set of names has another order in every process."""
    kinds = [kind for pair in itertools.permutations(SEGMENT_KINDS[:5], 2) for kind in pair]
    for first, second in zip(kinds[::2], kinds[1::2], strict=True):
        segments = tuple(
            Segment(5000 * k, 5000 * (k + 1), kind) for k, kind in enumerate((first, second, first, second))
        )
        signal = np.repeat([1.0, 1.0, 2.0, 2.0], 5000) * np.tile(two_levels[:5000], 4)
        (check,) = check_levels(make_recording(signal, 3 * signal, segments=segments))
        assert f"the strongest {first} (" in check.finding
