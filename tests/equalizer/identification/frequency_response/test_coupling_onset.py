from dataclasses import replace

import numpy as np
import pytest

from equalizer.identification.frequency_response.coupling import compute_worst_coupling
from equalizer.identification.frequency_response.coupling_onset import OnsetRule, find_coupling_onset
from equalizer.identification.frequency_response.frequency_response import FrequencyResponse
from equalizer.identification.frequency_response.transfer_estimate import estimate_transfer


def response_of(coupling, frequency_hz, noise=1e-4, seed=1) -> FrequencyResponse:
    """Two axes of unit gain, of which the first moves the second by `coupling`."""
    exact = np.zeros((len(frequency_hz), 2, 2), complex)
    exact[:, 0, 0] = exact[:, 1, 1] = 1.0
    exact[:, 1, 0] = coupling
    parts = np.random.default_rng(seed).standard_normal((2, *exact.shape)) * noise / np.sqrt(2)
    return FrequencyResponse(
        frequency_hz,
        exact + parts[0] + 1j * parts[1],
        np.full(exact.shape, noise**2),
        np.ones((len(frequency_hz), 2)),
        np.ones(len(frequency_hz), bool),
        1000.0,
        ("fx", "fy"),
        ("ax", "ay"),
    )


LINES = np.arange(3.0, 60.0, 1 / 30)


def test_the_crossing_of_the_threshold_is_found_between_the_lines():
    found = find_coupling_onset(response_of(0.25 * LINES / 12.0, LINES))
    assert found.frequency_hz == pytest.approx(12.0, abs=0.01)
    assert found.interval_hz[0] < 12.0 < found.interval_hz[1]
    assert found.interval_hz[1] - found.interval_hz[0] < 0.05
    assert not found.is_at_lowest_line


def test_a_bump_much_shorter_than_a_twelfth_of_an_octave_is_passed_over():
    bump = np.where((LINES > 10.0) & (LINES < 10.2), 0.5, 0.05) + 0.3 * (LINES > 30.0)
    assert find_coupling_onset(response_of(bump, LINES)).frequency_hz == pytest.approx(30.0, abs=0.5)


def test_a_resonance_over_an_eighth_of_an_octave_is_the_onset():
    bump = np.where((LINES > 10.0) & (LINES < 10.9), 0.5, 0.05)
    assert find_coupling_onset(response_of(bump, LINES)).frequency_hz == pytest.approx(10.0, abs=0.15)


def test_no_coupling_has_no_onset():
    found = find_coupling_onset(response_of(0.1 + 0 * LINES, LINES))
    assert (found.frequency_hz, found.interval_hz) == (None, None)


def test_noise_alone_is_no_coupling():
    onsets = [find_coupling_onset(response_of(0.05 + 0 * LINES, LINES, 0.12, seed)).frequency_hz for seed in range(9)]
    assert onsets == [None] * 9
    assert np.any(compute_worst_coupling(response_of(0.05 + 0 * LINES, LINES, 0.12).response) > 0.25)


def test_lines_that_are_too_noisy_are_not_judged():
    """A tenth of the lines tell nothing, and lie first."""
    response = response_of(0.25 * LINES / 12.0, LINES)
    loud = np.where(LINES < 5.0, 0.5, 0.0)[:, None, None] * np.random.default_rng(2).standard_normal((2, 2))
    noisy = replace(
        response, response=response.response + loud, noise_variance=response.noise_variance + np.abs(loud) ** 2
    )
    assert find_coupling_onset(noisy).frequency_hz == pytest.approx(12.0, abs=0.02)


def test_all_lines_too_noisy_is_refused_with_what_would_do():
    with pytest.raises(ValueError, match="at no line is the noise small compared with 25 % .*record more periods"):
        find_coupling_onset(response_of(0.05 + 0 * LINES, LINES, noise=1.0))


def test_coupled_from_the_start_is_reported():
    found = find_coupling_onset(response_of(0.4 + 0 * LINES, LINES))
    assert found.is_at_lowest_line
    assert found.frequency_hz == LINES[0]


@pytest.mark.slow
def test_the_interval_covers_the_truth_and_is_no_wider_than_it_must_be():
    """95 of 100 in the long run."""
    found = [
        find_coupling_onset(response_of(0.25 * LINES / 12.0, LINES, 0.03, seed), OnsetRule(draws=100))
        for seed in range(30)
    ]
    covered = [each.interval_hz[0] <= 12.0 <= each.interval_hz[1] for each in found]
    spread = np.std([each.frequency_hz for each in found])
    width = np.mean([each.interval_hz[1] - each.interval_hz[0] for each in found])
    assert sum(covered) >= 25
    assert 0.7 < width / (2 * 1.96 * spread) < 1.5


@pytest.mark.slow
def test_the_same_seed_gives_the_same_interval():
    response = response_of(0.25 * LINES / 12.0, LINES, 0.05)
    first, again, other = (find_coupling_onset(response, OnsetRule(seed=seed)) for seed in (1, 1, 2))
    assert first == again
    assert first.interval_hz != other.interval_hz


@pytest.mark.slow
def test_the_synthetic_device_couples_from_nine_hertz_on(plants, synthetic):
    fine = np.arange(8.0, 11.0, 0.002)
    exact = compute_worst_coupling(plants.omega_like().response(fine))
    mean = [exact[np.abs(np.log2(fine / at)) < 1 / 24].mean() for at in fine]
    true = fine[np.argmax(np.array(mean) > 0.25)]
    found = find_coupling_onset(estimate_transfer((synthetic.sweeps(plants, 4.5, 37.0, 30.0),)))
    assert found.frequency_hz == pytest.approx(true, abs=0.04)
    assert found.interval_hz[0] < true < found.interval_hz[1]
    assert "25 %" in found.rule and "1/12 octave" in found.rule


def test_unequal_axes_have_no_coupling():
    response = response_of(0.1 + 0 * LINES, LINES)
    narrow = FrequencyResponse(
        LINES, response.response[:, :, :1], response.noise_variance[:, :, :1], response.coherence, response.reliable,
        1000.0, ("fx",), ("ax", "ay"),
    )  # fmt: skip
    with pytest.raises(ValueError, match="2 outputs and 1 inputs"):
        find_coupling_onset(narrow)
