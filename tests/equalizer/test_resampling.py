import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from equalizer.signals.resampling import Grid, Samples, resample


def even(values, rate_hz=1000.0, start_s=0.0):
    return Samples(start_s + np.arange(len(values)) / rate_hz, values, rate_hz, 1.5 / rate_hz)


def sine(times_s, frequency_hz):
    return np.sin(2 * np.pi * frequency_hz * times_s + 0.3)


@pytest.mark.parametrize("rate_hz", [2000.0, 1500.0, 1234.5, 500.0, 441.0])
@pytest.mark.parametrize("share", [0.02, 0.2, 0.4])
def test_a_sinusoid_is_recovered_to_a_ten_thousandth_up_to_four_fifths_of_nyquist(rate_hz, share):
    frequency_hz = share * min(1000.0, rate_hz)
    samples = even(sine(np.arange(4000) / 1000, frequency_hz))
    grid = Grid(0.1, rate_hz, int(3.7 * rate_hz))
    found = resample(samples, grid, "band-limited")
    np.testing.assert_allclose(found, sine(grid.compute_times_s(), frequency_hz), atol=1e-4)


@settings(max_examples=20, deadline=None)
@given(shift_s=st.floats(0.1, 0.2), frequency_hz=st.floats(1, 400))
@example(shift_s=0.1969990976217758, frequency_hz=18.0)
@example(shift_s=0.1969990976217758, frequency_hz=399.0)
def test_a_shift_by_a_part_of_a_sample_is_exact_to_a_ten_thousandth(shift_s, frequency_hz):
    samples = even(sine(np.arange(2000) / 1000, frequency_hz))
    grid = Grid(shift_s, 1000.0, 1700)
    found = resample(samples, grid, "band-limited")[50:-50]
    np.testing.assert_allclose(found, sine(grid.compute_times_s(), frequency_hz)[50:-50], atol=1e-4)


def test_what_a_slower_rate_cannot_carry_is_taken_out():
    samples = even(sine(np.arange(4000) / 1000, 400.0))
    found = resample(samples, Grid(0.1, 500.0, 1700), "band-limited")
    assert np.max(np.abs(found[50:-50])) < 1e-4
    assert np.max(np.abs(resample(samples, Grid(0.1, 500.0, 1700), "held"))) > 0.9


@pytest.mark.parametrize(("frequency_hz", "within"), [(50.0, 1e-6), (100.0, 5e-5), (200.0, 2e-3)])
@pytest.mark.parametrize("rate_hz", [500.0, 999.0, 2857.0])
def test_uneven_stamps_are_recovered_as_well_as_the_page_says(frequency_hz, within, rate_hz):
    steps_s = np.random.default_rng(1).choice([0.7e-3, 1.05e-3], p=[0.15, 0.85], size=4000)
    times_s = np.cumsum(steps_s)
    grid = Grid(0.1, rate_hz, int(3.0 * rate_hz))
    found = resample(Samples(times_s, sine(times_s, frequency_hz), 0.0, 3e-3), grid, "band-limited")
    np.testing.assert_allclose(
        found[50:-50], sine(grid.compute_times_s(), frequency_hz)[50:-50], atol=max(within, 5e-6)
    )


def test_a_held_staircase_is_recovered_exactly_and_an_interpolated_one_is_not():
    stairs = np.random.default_rng(2).standard_normal(200)
    samples, grid = even(stairs, 100.0), Grid(0.0, 1000.0, 1990)
    truth = np.repeat(stairs, 10)[:1990]
    np.testing.assert_array_equal(resample(samples, grid, "held"), truth)
    assert np.std(resample(samples, grid, "band-limited") - truth) > 0.3
    assert np.std(resample(samples, grid, "linear") - truth) > 0.3


def test_a_straight_line_stays_one():
    samples, grid = even(np.arange(50.0), 100.0), Grid(0.0, 333.0, 160)
    np.testing.assert_allclose(resample(samples, grid, "linear"), grid.compute_times_s() * 100, atol=1e-9)


@pytest.mark.parametrize("count", [2, 3, 4, 5, 6])
def test_few_uneven_samples_are_interpolated_by_a_lower_degree(count):
    times_s = np.arange(count) / 100
    samples = Samples(times_s, 3.0 + 200.0 * times_s, 0.0, 0.1)
    grid = Grid(0.0, 200.0, 2 * count - 1)
    np.testing.assert_allclose(resample(samples, grid, "band-limited"), 3 + 200 * grid.compute_times_s(), atol=1e-9)


@pytest.mark.parametrize("method", ["held", "linear", "band-limited"])
def test_a_missing_sample_stays_missing_and_its_neighbours_stay_there(method):
    values = sine(np.arange(400) / 1000, 10.0)
    values[200] = np.nan
    grid = Grid(0.0, 2000.0, 799)
    found = resample(even(values), grid, method)
    missing = np.flatnonzero(np.isnan(found))
    assert set(missing) == ({400, 401} if method == "held" else {399, 400, 401})


@pytest.mark.parametrize("method", ["held", "linear", "band-limited"])
def test_a_gap_in_the_stamps_becomes_missing_samples(method):
    times_s = np.concatenate([np.arange(0, 0.1, 1e-3), np.arange(0.15, 0.25, 1e-3)])
    samples = Samples(times_s, sine(times_s, 20.0), 0.0, 3e-3)
    grid = Grid(0.0, 1000.0, 249)
    found = resample(samples, grid, method)
    assert set(np.flatnonzero(np.isnan(found))) == set(range(100, 150))
    if method == "band-limited":
        here = np.isfinite(found)
        np.testing.assert_allclose(found[here], sine(grid.compute_times_s(), 20.0)[here], atol=1e-9)


def test_a_grid_that_leaves_the_samples_is_refused():
    with pytest.raises(ValueError, match=r"the grid from 0 to 0.5 s leaves the samples, 0 to 0.099 s"):
        resample(even(np.zeros(100)), Grid(0.0, 1000.0, 501), "held")


def test_a_signal_without_samples_is_refused():
    with pytest.raises(ValueError, match="fewer than two samples have a value"):
        resample(even(np.full(100, np.nan)), Grid(0.0, 1000.0, 50), "linear")
