"""Multisines: which lines, which peak, which phases."""

import numpy as np
import pytest

from equalizer.signals.multisine import list_lines_between, make_multisines

RATE_HZ, PERIOD = 1000.0, 4000


def spectrum(wave):
    return np.fft.rfft(wave, axis=0) / len(wave)


@pytest.fixture(scope="module")
def lines():
    return list_lines_between(5.0, 35.0, PERIOD, RATE_HZ, odd_only=True)


def test_the_lines_are_the_odd_ones_of_the_band_with_its_ends():
    assert list(list_lines_between(1.0, 3.0, 5000, RATE_HZ, odd_only=True)) == [5, 7, 9, 11, 13, 15]
    assert list(list_lines_between(1.0, 3.0, 2000, RATE_HZ, odd_only=False)) == [2, 3, 4, 5, 6]


def test_no_line_lies_at_half_the_rate_where_it_could_have_no_phase():
    assert list_lines_between(499.0, 500.0, 1000, RATE_HZ, odd_only=False).tolist() == [499]


@pytest.mark.parametrize(("from_hz", "to_hz"), [(0.0, 10.0), (20.0, 10.0), (1.0, 501.0)])
def test_a_multisine_that_cannot_be_is_refused(from_hz, to_hz):
    with pytest.raises(ValueError, match="half the rate"):
        list_lines_between(from_hz, to_hz, 1000, RATE_HZ, odd_only=False)


def test_a_period_too_short_for_a_line_is_refused():
    with pytest.raises(ValueError, match=r"a period of 0\.5 s has no odd line from 3 to 5 Hz"):
        list_lines_between(3.0, 5.0, 500, RATE_HZ, odd_only=True)


def test_all_lines_are_equally_strong_and_nothing_lies_between_them(lines):
    (wave,) = make_multisines(lines, PERIOD, 1.5, axes=1, realisations=1, seed=3)
    size = np.abs(spectrum(wave))[:, 0]
    assert size[lines] == pytest.approx(np.full(len(lines), size[lines[0]]), rel=1e-9)
    assert np.delete(size, lines).max() < 1e-12 * size[lines[0]] * len(lines)


@pytest.mark.parametrize("axes", [1, 3])
def test_the_peak_is_the_one_asked_for_and_not_far_above_the_rest(lines, axes):
    for wave in make_multisines(lines, PERIOD, 1.5, axes=axes, realisations=4, seed=3):
        norm = np.linalg.norm(wave, axis=1)
        assert norm.max() == pytest.approx(1.5, rel=1e-12)
        assert norm.max() < 3.5 * np.sqrt(np.mean(norm**2))


def test_a_seed_gives_the_same_excitation_however_many_are_asked_for(lines):
    three = make_multisines(lines, PERIOD, 1.0, axes=1, realisations=3, seed=3)
    (single,) = make_multisines(lines, PERIOD, 1.0, axes=1, realisations=1, seed=3)
    assert np.array_equal(three[0], single)
    assert not np.allclose(three[0], three[1])
    assert not np.allclose(single, make_multisines(lines, PERIOD, 1.0, axes=1, realisations=1, seed=4)[0])


def test_three_realisations_on_three_axes_are_orthogonal_at_every_line(lines):
    waves = make_multisines(lines, PERIOD, 1.0, axes=3, realisations=3, seed=3)
    U = np.stack([spectrum(wave)[lines] for wave in waves], axis=1)
    U /= np.linalg.norm(U, axis=2, keepdims=True)
    assert np.abs(U @ U.conj().transpose(0, 2, 1) - np.eye(3)).max() < 1e-9


def test_axes_have_phases_of_their_own(lines):
    (wave,) = make_multisines(lines, PERIOD, 1.0, axes=3, realisations=1, seed=3)
    correlation = np.corrcoef(wave.T) - np.eye(3)
    assert np.abs(correlation).max() < 0.35
    assert wave.std(axis=0) == pytest.approx(np.full(3, wave[:, 0].std()), rel=1e-9)


def test_random_phases_average_out_odd_distortion_which_equal_periods_cannot_do(lines):
    """The response of y = u + 0.3 u³ at the lines scatters over realisations, and not over periods."""
    gains = []
    for wave in make_multisines(lines, PERIOD, 1.0, axes=1, realisations=12, seed=5):
        gains.append(spectrum(wave + 0.3 * wave**3)[lines, 0] / spectrum(wave)[lines, 0])
    scatter = np.std(gains, axis=0).mean()
    assert scatter > 0.005
    assert np.abs(np.mean(gains, axis=0).imag).mean() < scatter


def test_even_distortion_falls_between_the_lines(lines):
    (wave,) = make_multisines(lines, PERIOD, 1.0, axes=1, realisations=1, seed=5)
    squared = np.abs(spectrum(wave**2))[:, 0]
    assert squared[lines].max() < 1e-12
    assert squared[lines - 1].max() > 1e-3
