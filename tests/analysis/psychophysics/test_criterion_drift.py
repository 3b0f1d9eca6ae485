"""A drift of the response bias is distinguished from criteria that differ between runs without any order."""

import numpy as np
import pytest
from scipy.stats import linregress

from analysis.psychophysics.bias import estimate_response_bias
from analysis.psychophysics.criterion_drift import estimate_criterion_drifts
from tests.analysis.psychophysics.test_bias import simulate_answers
from tests.slow_instances import slow_after


def simulate_session(per_100_trials: float, seed: int, start: float = 0.0, runs: int = 5, n: int = 70, sd: float = 0.0):
    offsets = start + sd * np.random.default_rng([seed, 1]).standard_normal(runs)
    return [
        simulate_answers(1.64, offsets[run] + per_100_trials * (run + 0.5) * n / 100.0, n, 1000 * seed + run)
        for run in range(runs)
    ]


def single_drift(runs):
    (drift,) = estimate_criterion_drifts([runs])
    return drift


@pytest.mark.parametrize("per_100_trials", [0.0, 0.2, -0.2])
def test_a_drift_is_recovered_with_its_sign(per_100_trials):
    found = [single_drift(simulate_session(per_100_trials, seed)).per_100_trials for seed in range(60)]
    assert np.mean(found) == pytest.approx(per_100_trials, abs=0.03)


@pytest.mark.slow
@pytest.mark.parametrize("criterion", [0.0, 0.5])
def test_no_drift_is_found_as_often_as_the_level_says(criterion):
    p = np.array(
        [each.p for each in estimate_criterion_drifts([simulate_session(0.0, seed, criterion) for seed in range(1000)])]
    )
    assert np.mean(p < 0.05) == pytest.approx(0.05, abs=0.025)
    assert np.mean(p < 0.01) < 0.02


@pytest.mark.parametrize("sd", slow_after(1, [0.2, 0.3]))
@pytest.mark.parametrize("size", [1, 10])
def test_criteria_that_vary_without_an_order_are_no_drift(sd, size):
    """Of 600 sessions with p below 0.05, by binomial variance alone a fifth and a third."""
    sessions = [simulate_session(0.0, seed, sd=sd) for seed in range(600)]
    studies = [sessions[start : start + size] for start in range(0, len(sessions), size)]
    p = np.array([each.p for study in studies for each in estimate_criterion_drifts(study)])
    assert np.mean(p < 0.05) < 0.085
    assert np.mean(p < 0.05) > 0.02


def test_a_session_alone_has_the_dispersion_of_its_own_residuals():
    """By hand: runs of one length, d' and variance v, so that chi squared is the sum of squares over v; Student's test
    of the slope is then that of the textbook, without v."""
    shown = [1, 2] * 35
    # Rates of right answers alike, criteria not: the errors are shifted between the two directions.
    wrong_of_1 = (2, 14, 4, 12, 7)
    runs = [(shown, [*_correct_answers(wrong, 14 - wrong)]) for wrong in wrong_of_1]
    line = linregress(35.0 + 70.0 * np.arange(5), [estimate_response_bias(*run).criterion for run in runs])
    assert single_drift(runs).per_100_trials == pytest.approx(100.0 * line.slope)
    assert single_drift(runs).p == pytest.approx(line.pvalue)


def _correct_answers(wrong_of_1, wrong_of_2):
    for pair in range(35):
        yield pair >= wrong_of_1
        yield pair >= wrong_of_2


def test_a_session_takes_part_in_the_dispersion_of_the_others():
    """A line without scatter among nine that scatter is less sure than alone."""
    line, others = simulate_session(0.4, 3), [simulate_session(0.0, seed, sd=0.8) for seed in range(10, 19)]
    assert estimate_criterion_drifts([line, *others])[0].p > single_drift(line).p


def test_two_runs_or_one_direction_alone_show_no_drift():
    assert single_drift(simulate_session(1.0, 1, runs=2)) is None
    assert single_drift([*simulate_session(1.0, 1, runs=2), ([1, 1, 1], [True, True, False])]) is None
    assert single_drift([]) is None
    assert estimate_criterion_drifts([]) == ()
    assert estimate_criterion_drifts([simulate_session(1.0, 1, runs=2), simulate_session(1.0, 1)])[1] == single_drift(
        simulate_session(1.0, 1)
    )
