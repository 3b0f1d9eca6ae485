import numpy as np
import pytest
from scipy.signal import periodogram

from equalizer.signals.masking_noise import FULL_SCALE, HEADROOM_DB, make_masking_noise

RATE_HZ = 44_100


@pytest.fixture(scope="module")
def noise():
    return make_masking_noise(10, 40.0, 8000.0, seed=1)


@pytest.fixture(scope="module")
def density(noise):
    return periodogram(noise.astype(np.float64), RATE_HZ, detrend=False)


def power_in(density, low_hz, high_hz):
    frequencies_hz, power = density
    return power[(frequencies_hz >= low_hz) & (frequencies_hz < high_hz)].sum()


def test_the_power_falls_by_three_decibels_per_octave(density):
    frequencies_hz, power = density
    band = (frequencies_hz >= 40) & (frequencies_hz <= 8000)
    slope = np.polyfit(np.log2(frequencies_hz[band]), 10 * np.log10(power[band]), 1)[0]
    assert slope == pytest.approx(10 * np.log10(1 / 2), abs=0.01)


def test_every_octave_holds_the_same_power(density):
    octaves = [power_in(density, 50.0 * 2**k, 100.0 * 2**k) for k in range(7)]
    assert octaves == pytest.approx([octaves[0]] * 7, rel=0.01)


def test_outside_the_corners_there_is_nothing_but_rounding(density):
    outside = power_in(density, 0.5, 40) + power_in(density, 8001, RATE_HZ / 2)
    assert outside < 1e-6 * power_in(density, 40, 8001)


def hiss_share(period, place):
    """Share of the power above the upper corner in a fifth of a second around a place of the endless loop."""
    piece = np.roll(period, RATE_HZ // 10 - place)[: RATE_HZ // 5].astype(np.float64)
    short = periodogram(piece, RATE_HZ, window="blackmanharris", detrend=False)
    return power_in(short, 9000, RATE_HZ / 2) / power_in(short, 40, 9000)


def test_the_seam_of_the_loop_is_like_any_other_place(noise):
    elsewhere = max(hiss_share(noise, place) for place in range(RATE_HZ, 9 * RATE_HZ, RATE_HZ // 2))
    assert hiss_share(noise, 0) < 2 * elsewhere


def test_a_noise_cut_short_has_a_seam_that_shows(noise):
    """The control: the same measure finds a loop that was not made as one."""
    cut = noise[: 9 * RATE_HZ]
    assert hiss_share(cut, 0) > 100 * hiss_share(cut, RATE_HZ)


def test_the_peak_keeps_its_headroom(noise):
    peak = np.abs(noise.astype(np.int32)).max()
    assert 20 * np.log10(peak / FULL_SCALE) == pytest.approx(-HEADROOM_DB, abs=0.01)
    assert noise.dtype == np.int16


def test_the_values_are_those_of_noise_and_not_of_a_click(noise):
    crest_db = 20 * np.log10(np.abs(noise).max() / noise.astype(np.float64).std())
    assert 10 < crest_db < 18


def test_a_seed_is_a_noise(noise):
    assert np.array_equal(make_masking_noise(10, 40.0, 8000.0, seed=1), noise)
    other = make_masking_noise(10, 40.0, 8000.0, seed=2).astype(np.float64)
    assert abs(np.corrcoef(other, noise)[0, 1]) < 0.05


@pytest.mark.parametrize(
    ("seconds", "low_hz", "high_hz", "problem"),
    [
        (0, 40.0, 8000.0, "seconds is 0; noise lasts at least 1 s"),
        (1, 8000.0, 40.0, "not 8000 to 40"),
        (1, 0.0, 40.0, "0 < low_hz"),
        (1, 40.0, 30000.0, "22050 Hz"),
        (1, 40.2, 40.4, "no multiple of 1 / 1 Hz lies between 40.2 and 40.4 Hz"),
    ],
)
def test_noise_that_cannot_be_is_refused_with_its_numbers(seconds, low_hz, high_hz, problem):
    with pytest.raises(ValueError, match=problem):
        make_masking_noise(seconds, low_hz, high_hz, seed=1)
