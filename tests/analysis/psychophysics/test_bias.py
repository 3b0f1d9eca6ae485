from statistics import NormalDist

import numpy as np
import pytest

from analysis.psychophysics.bias import estimate_response_bias


def simulate_answers(d_prime: float, criterion: float, n: int, seed: int) -> tuple[list[int], list[bool]]:
    """Equal-variance observer: direction 1 gives evidence around +d'/2, direction 2 around -d'/2."""
    generator = np.random.default_rng(seed)
    shown = generator.integers(1, 3, n)
    evidence = generator.normal(np.where(shown == 1, d_prime / 2, -d_prime / 2))
    said = np.where(evidence > criterion, 1, 2)
    return shown.tolist(), (said == shown).tolist()


@pytest.mark.parametrize(("d_prime", "criterion"), [(0.0, 0.0), (1.64, 0.0), (1.64, 0.5), (2.5, -1.0)])
def test_sensitivity_and_criterion_are_recovered(d_prime, criterion):
    bias = estimate_response_bias(*simulate_answers(d_prime, criterion, 20_000, seed=5))
    assert bias.d_prime == pytest.approx(d_prime, abs=0.06)
    assert bias.criterion == pytest.approx(criterion, abs=0.04)


def test_the_log_linear_correction_is_by_hand():
    # Three of three hits, no false alarm in three: rates 3.5/4 and 0.5/4.
    bias = estimate_response_bias([1, 1, 1, 2, 2, 2], [True] * 6)
    assert bias.d_prime == pytest.approx(2 * NormalDist().inv_cdf(0.875))
    assert bias.criterion == pytest.approx(0.0)


def test_always_answering_two_shows_as_a_positive_criterion():
    shown = [1, 2] * 30
    bias = estimate_response_bias(shown, [direction == 2 for direction in shown])
    assert bias.d_prime == pytest.approx(0.0)
    assert bias.criterion > 2


def test_one_direction_alone_says_nothing():
    assert estimate_response_bias([1, 1], [True, False]) is None
    assert estimate_response_bias([], []) is None
