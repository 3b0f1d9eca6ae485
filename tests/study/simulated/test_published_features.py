"""What the one parameter set was chosen to give, all with 1 N. The bounds are ours: published are curves."""

import numpy as np
import pytest

OFF = ~np.eye(3, dtype=bool)


def levels(bench, frequencies_hz):
    """Magnitudes (frequencies, 3, 3)."""
    return np.array([np.abs(bench.matrix(f)) for f in frequencies_hz])


def worst_coupling(magnitudes):
    return magnitudes[:, OFF].max(axis=1) / np.einsum("fii->fi", magnitudes).mean(axis=1)


def test_friction_and_damping_make_the_slope_below_ten_hertz(bench):
    diagonals = np.einsum("fii->fi", levels(bench, [2.0, 4.0, 8.0]))
    per_octave_db = 20 * np.log10(diagonals[1:] / diagonals[:-1])
    assert np.all((per_octave_db > 2) & (per_octave_db < 9))


def test_a_coupled_resonance_stands_near_eleven_hertz(bench):
    frequencies_hz = np.array([7.0, 8.0, 9.0, 10.0, 10.5, 11.0, 11.5, 12.0, 13.0, 14.0])
    magnitudes = levels(bench, frequencies_hz)
    x_to_y = np.sqrt(magnitudes[:, 0, 1] * magnitudes[:, 1, 0])
    assert 10.5 <= frequencies_hz[x_to_y.argmax()] <= 11.5
    assert x_to_y.max() > 3 * max(x_to_y[0], x_to_y[-1])
    along_x = magnitudes[:, 0, 0]
    assert along_x.max() / along_x[3:].min() > 1.5


def test_coupling_sets_in_about_ten_hertz(bench):
    x_to_y = levels(bench, [5.0, 8.0, 10.0, 11.0])[:, 0, 1]
    assert x_to_y[0] < 0.05
    assert x_to_y[2] > 3 * x_to_y[1]
    assert x_to_y[3] > 10 * x_to_y[1]


@pytest.mark.parametrize("hand", [False, True])
def test_coupling_off_the_test_directions_orders_as_published(bench, direction, hand):
    at = {f: bench.coupling(f, direction, hand) for f in (5, 10, 15, 25, 35)}
    low = [at[5], at[10], at[15]]
    assert max(low) / min(low) < 1.3
    assert at[25] > 1.4 * max(low)
    assert at[35] < 0.7 * at[25]


def test_from_forty_to_sixty_five_hertz_nothing_rings_and_from_eighty_much_does(bench):
    quiet = levels(bench, [40.0, 45.0, 50.0, 55.0, 60.0, 65.0, 70.0, 75.0])
    diagonals = np.einsum("fii->fi", quiet)
    assert np.all(np.diff(diagonals, axis=0) > 0), "a skirt that rises has no peak on it"
    assert worst_coupling(quiet[:6]).max() < 0.15
    ringing = levels(bench, [82.0, 88.0, 95.0])
    assert np.einsum("fii->fi", ringing).min() > 2 * diagonals[1].max()
    assert worst_coupling(ringing).min() > 0.25


def test_coupling_grows_with_frequency_above_the_first_structural_modes(bench):
    magnitudes = levels(bench, [140.0, 190.0, 250.0, 320.0, 391.0])
    assert np.all(magnitudes[:, OFF].max(axis=1) > 0.8 * np.einsum("fii->fi", magnitudes).min(axis=1))
