"""A response read at other times, and which clocks make it so."""

from dataclasses import replace

import numpy as np
import pytest

from equalizer.effects.catalogue import EFFECTS
from equalizer.effects.simulation.interpolated_response import resample_response

RATE_HZ = 1000.0
ALL = (0, 1, 2)
DRIFT, OFFSET = EFFECTS["clock_drift"], EFFECTS["logger_offset"]


@pytest.fixture(scope="module")
def command(bench) -> np.ndarray:
    return bench.commands(3)


@pytest.mark.parametrize("frequency_hz", [3.0, 60.0, 240.0, 420.0])
def test_between_samples_a_band_limited_signal_is_what_it_is(frequency_hz):
    def sine(at: np.ndarray) -> np.ndarray:
        return np.sin(2 * np.pi * frequency_hz * at / RATE_HZ)[:, None]

    k = np.arange(3000.0)
    read = resample_response(sine(k), 1 + 3e-4, 0.37)
    np.testing.assert_allclose(read[40:-40], sine(k * (1 + 3e-4) + 0.37)[40:-40], atol=2e-4)


def test_straight_lines_are_numpys():
    k, values = np.arange(500.0), np.random.default_rng(4).standard_normal((500, 2))
    read = resample_response(values, 1 + 2e-3, -3.3, linear_share=1.0)
    expected = np.column_stack([np.interp(k * (1 + 2e-3) - 3.3, k, column) for column in values.T])
    np.testing.assert_allclose(read, expected, atol=1e-12)


def test_its_own_times_change_nothing():
    values = np.random.default_rng(4).standard_normal((500, 2))
    for straight in (0.0, 0.5, 1.0):
        np.testing.assert_allclose(resample_response(values, 1.0, 0.0, straight), values, atol=1e-12)


@pytest.mark.parametrize("ppm", [8.0, -60.0, 900.0])
@pytest.mark.parametrize("interpolated", [0.0, 1.0])
def test_a_drifting_clock_is_found_with_how_it_reads_between_samples(bench, command, ppm, interpolated):
    model, values = bench.three_axes(), {"ppm": ppm, "interpolated": interpolated}
    seen = bench.measured(model, bench.placed("clock_drift", values, *ALL), command, seed=4)
    start = DRIFT.starts(bench.evidence(model, seen), 0)[0]
    assert start["ppm"] == pytest.approx(ppm, rel=0.1)
    assert start["interpolated"] == interpolated


def test_a_drifting_clock_takes_the_position_with_it(bench, command):
    model = bench.three_axes()
    drifted = bench.measured(model, bench.placed("clock_drift", {"ppm": 500.0}, *ALL), command, seed=None)
    plain = bench.measured(model, (), command, seed=None)
    expected = resample_response(plain.position, 1 + 500e-6, 0.0)
    np.testing.assert_allclose(drifted.position, expected, atol=1e-12)


@pytest.mark.parametrize("with_position", [0.0, 1.0])
def test_whether_the_position_drifts_along_is_seen(bench, command, with_position):
    model, values = bench.three_axes(), {"ppm": 100.0, "with_position": with_position}
    seen = bench.measured(model, bench.placed("clock_drift", values, *ALL), command, seed=4)
    assert DRIFT.starts(bench.evidence(model, seen), 0)[0]["with_position"] == with_position


def test_where_the_position_does_not_show_its_clock_both_are_suggested(bench, command):
    """As where the model's error shifts the position by other times in each window."""
    model = bench.three_axes()
    evidence = bench.evidence(
        model, bench.measured(model, bench.placed("clock_drift", {"ppm": 100.0}, *ALL), command, 4)
    )
    window = int(2.0 * evidence.sample_rate_hz)
    shifts = np.random.default_rng(4).integers(-20, 21, len(command) // window + 1)
    shifted = np.vstack([
        np.roll(evidence.predicted_position[number * window : (number + 1) * window], shift, axis=0)
        for number, shift in enumerate(shifts)
    ])  # fmt: skip
    starts = DRIFT.starts(replace(evidence, predicted_position=shifted), 0)
    assert sorted((start["interpolated"], start["with_position"]) for start in starts) == [
        (0.0, 0.0), (0.0, 1.0), (1.0, 0.0), (1.0, 1.0)
    ]  # fmt: skip


@pytest.mark.parametrize("offset_s", [3e-4, -0.0123, 0.25])
def test_a_loggers_offset_is_found_and_spares_the_position(bench, command, offset_s):
    model = bench.three_axes()
    seen = bench.measured(model, bench.placed("logger_offset", {"offset": offset_s}, *ALL), command, seed=4)
    start = OFFSET.starts(bench.evidence(model, seen), 0)[0]
    assert start["offset"] == pytest.approx(offset_s, rel=0.1)
    np.testing.assert_array_equal(seen.played.position, bench.measured(model, (), command).played.position)


@pytest.mark.parametrize("seed", [1, 2])
def test_clocks_that_agree_suggest_nothing(bench, command, seed):
    model = bench.three_axes()
    evidence = bench.evidence(model, bench.measured(model, (), command, seed))
    assert DRIFT.starts(evidence, 0) == OFFSET.starts(evidence, 0) == ()


def test_all_channels_share_a_clock_so_that_one_suggests_it(bench, command):
    model = bench.three_axes()
    seen = bench.measured(model, bench.placed("clock_drift", {"ppm": 100.0}, *ALL), command)
    evidence = bench.evidence(model, seen)
    assert [len(DRIFT.starts(evidence, channel)) for channel in ALL] == [2, 0, 0]


def test_a_delay_is_no_drift(bench, command):
    model = bench.three_axes()
    seen = bench.measured(model, bench.placed("transport_delay", {"delay": 2e-3}, *ALL), command)
    assert DRIFT.starts(bench.evidence(model, seen), 0) == ()


def test_a_clock_slower_than_any_lateness_that_is_looked_for_shows_no_drift(bench, command):
    model = bench.three_axes()
    seen = bench.evidence(model, bench.measured(model, (), command, seed=4))
    assert DRIFT.starts(replace(seen, sample_rate_hz=0.25), 0) == ()
