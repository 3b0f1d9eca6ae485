from statistics import NormalDist

import numpy as np
import pytest

from analysis.psychophysics.bias import criterion_drift, response_bias


def answers(d_prime: float, criterion: float, n: int, seed: int) -> tuple[list[int], list[bool]]:
    """Equal-variance observer: direction 1 gives evidence around +d'/2, direction 2 around -d'/2."""
    generator = np.random.default_rng(seed)
    shown = generator.integers(1, 3, n)
    evidence = generator.normal(np.where(shown == 1, d_prime / 2, -d_prime / 2))
    said = np.where(evidence > criterion, 1, 2)
    return shown.tolist(), (said == shown).tolist()


@pytest.mark.parametrize(("d_prime", "criterion"), [(0.0, 0.0), (1.64, 0.0), (1.64, 0.5), (2.5, -1.0)])
def test_sensitivity_and_criterion_are_recovered(d_prime, criterion):
    bias = response_bias(*answers(d_prime, criterion, 20_000, seed=5))
    assert bias.d_prime == pytest.approx(d_prime, abs=0.06)
    assert bias.criterion == pytest.approx(criterion, abs=0.04)


def test_the_log_linear_correction_is_by_hand():
    # Three of three hits, no false alarm in three: rates 3.5/4 and 0.5/4.
    bias = response_bias([1, 1, 1, 2, 2, 2], [True] * 6)
    assert bias.d_prime == pytest.approx(2 * NormalDist().inv_cdf(0.875))
    assert bias.criterion == pytest.approx(0.0)


def test_always_answering_two_shows_as_a_positive_criterion():
    shown = [1, 2] * 30
    bias = response_bias(shown, [direction == 2 for direction in shown])
    assert bias.d_prime == pytest.approx(0.0)
    assert bias.criterion > 2


def test_one_direction_alone_says_nothing():
    assert response_bias([1, 1], [True, False]) is None
    assert response_bias([], []) is None


def drifting(per_100_trials: float, seed: int, start: float = 0.0, runs: int = 5, n: int = 70):
    return [
        answers(1.64, start + per_100_trials * (run + 0.5) * n / 100.0, n, 1000 * seed + run) for run in range(runs)
    ]


@pytest.mark.parametrize("per_100_trials", [0.0, 0.2, -0.2])
def test_a_drift_is_recovered_with_its_sign(per_100_trials):
    found = [criterion_drift(drifting(per_100_trials, seed)).per_100_trials for seed in range(60)]
    assert np.mean(found) == pytest.approx(per_100_trials, abs=0.03)


@pytest.mark.parametrize("criterion", [0.0, 0.5])
def test_no_drift_is_found_as_often_as_the_level_says(criterion):
    p = np.array([criterion_drift(drifting(0.0, seed, criterion)).p for seed in range(1000)])
    assert np.mean(p < 0.05) == pytest.approx(0.05, abs=0.025)
    assert np.mean(p < 0.01) < 0.02


def test_two_runs_or_one_direction_alone_show_no_drift():
    assert criterion_drift(drifting(1.0, 1, runs=2)) is None
    assert criterion_drift([*drifting(1.0, 1, runs=2), ([1, 1, 1], [True, True, False])]) is None
    assert criterion_drift([]) is None
