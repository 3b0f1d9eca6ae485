from dataclasses import replace

import numpy as np
import pytest

from equalizer.identification.frequency_response.local_polynomial import smooth_response
from equalizer.identification.frequency_response.transfer_estimate import estimate_transfer


@pytest.fixture(scope="module")
def pairs(plants, synthetic):
    """Estimates of 30 s sweeps of the fitted band, and what smoothing makes of them."""
    estimates = [estimate_transfer((synthetic.sweeps(plants, 4.5, 37.0, 30.0, seed=seed),)) for seed in range(3)]
    return [(estimate, smooth_response(estimate)) for estimate in estimates]


@pytest.mark.slow
def test_the_error_falls_by_the_factor_of_seventeen_lines_and_a_parabola(pairs, plants, synthetic):
    truth = plants.omega_like()
    for estimate, smooth in pairs:
        before, after = (synthetic.rms_error(each, truth) for each in (estimate, smooth))
        assert after < 0.0045
        assert before / after == pytest.approx(2.74, rel=0.1)


@pytest.mark.slow
def test_the_peak_at_eleven_hertz_is_not_cut_beyond_the_noise(pairs, plants):
    """Averaged over the seeds, what is left is bias."""
    peak = [smooth.select_band(10.5, 11.5) for _, smooth in pairs]
    left = np.mean([each.response for each in peak], axis=0) - plants.omega_like().response(peak[0].frequency_hz)
    noise = peak[0].noise_variance / len(pairs)
    assert np.mean(np.abs(left) ** 2 / noise) < 1.3


@pytest.mark.slow
def test_the_variance_of_the_smooth_response_is_that_of_its_errors(pairs, plants):
    ratios = []
    for _, smooth in pairs:
        band = smooth.select_band(5.0, 35.0)
        left = band.response - plants.omega_like().response(band.frequency_hz)
        ratios.append(np.abs(left) ** 2 / band.noise_variance)
    assert 0.7 < np.mean(ratios) < 1.2


def test_without_noise_a_peak_that_is_too_narrow_shows_in_the_variance(plants, synthetic):
    """Lines 0.2 Hz apart: seventeen of them span the whole resonance."""
    smooth = smooth_response(estimate_transfer((synthetic.sweeps(plants, 4.5, 37.0, 5.0, noise=0.0),)))
    peak = smooth.select_band(10.0, 12.0)
    left = np.abs(peak.response - plants.omega_like().response(peak.frequency_hz)) ** 2
    assert left.mean() < 4 * peak.noise_variance.mean()
    assert peak.noise_variance.mean() > 10 * smooth.select_band(25.0, 28.0).noise_variance.mean()


def test_a_parabola_is_left_as_it_is(pairs):
    estimate = pairs[0][0]
    parabola = (1 + 2j) * (estimate.frequency_hz - 9.0) ** 2 + 3.0
    exact = replace(estimate, response=np.broadcast_to(parabola[:, None, None], estimate.response.shape))
    assert np.allclose(smooth_response(exact).response, exact.response, rtol=1e-9)


def test_frequencies_reliability_and_channels_stay_and_a_remark_says_what_was_done(pairs):
    estimate, smooth = pairs[0]
    assert (smooth.frequency_hz == estimate.frequency_hz).all()
    assert (smooth.reliable == estimate.reliable).all()
    assert smooth.remarks[-1] == "Smoothed: order 2 over 17 lines."


def test_too_few_lines_are_refused(pairs):
    estimate = pairs[0][0]
    with pytest.raises(ValueError, match="smoothing takes 17 lines at a time, but there are 16"):
        smooth_response(estimate.select_lines(np.arange(len(estimate)) < 16))
    with pytest.raises(ValueError, match="a polynomial of order 2 needs more than 3 lines"):
        smooth_response(estimate, neighbours=1)
