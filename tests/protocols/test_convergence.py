"""Where runs of the staircase end, measured with observers whose threshold is known."""

import math
from dataclasses import replace

import numpy as np
import pytest

from protocols.definition.staircase_rule import StaircaseRule, StepPhase
from protocols.procedure.staircase import begin_staircase, compute_level_n, is_finished, step, to_newton

TARGET = 0.5 ** (1 / 3)
RUNS = 250


def weibull(threshold_n: float, slope: float, lapse: float = 0.0):
    at_target = -math.log(1 - (TARGET - 0.5) / (0.5 - lapse))
    return lambda level: lapse + (1 - 2 * lapse) * (1 - 0.5 * math.exp(-at_target * (level / threshold_n) ** slope))


def measured(rule: StaircaseRule, share_right, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Thresholds in N and numbers of trials of RUNS runs."""
    rng = np.random.default_rng(seed)
    found, trials = [], []
    for _ in range(RUNS):
        state = begin_staircase(rule)
        while not is_finished(rule, state):
            state = step(rule, state, rng.random() < share_right(compute_level_n(rule, state)))
        found.append(np.mean([to_newton(level) for level in state.reversal_levels_db[-rule.averaged_reversals :]]))
        trials.append(state.trials)
    return np.array(found), np.array(trials)


def test_an_able_observer_ends_near_the_true_threshold(published):
    found, trials = measured(published, weibull(10**-0.5, 2.0), seed=1)
    errors_db = 20 * np.log10(found / 10**-0.5)
    assert abs(errors_db.mean()) < 0.5
    assert 1.4 < errors_db.std(ddof=1) < 2.0
    assert 60 < trials.mean() < 70


def test_a_guesser_ends_near_the_cap_and_takes_long(published):
    found, trials = measured(published, lambda level: 0.5, seed=2)
    assert 2.60 < found.mean() < 2.75
    assert 100 < trials.mean() < 120


@pytest.mark.parametrize(("down", "target"), [(2, 0.5 ** (1 / 2)), (3, 0.5 ** (1 / 3)), (4, 0.5 ** (1 / 4))])
def test_long_runs_of_small_steps_converge_where_levitt_says(published, down, target):
    rule = replace(
        published,
        start_n=0.3,
        down_after_right=down,
        steps=(StepPhase(0.5, 100),),
        reversals=100,
        averaged_reversals=90,
    )
    share_right = weibull(0.3, 2.0)
    rng = np.random.default_rng(3)
    shares = []
    for _ in range(12):
        state = begin_staircase(rule)
        while not is_finished(rule, state):
            state = step(rule, state, rng.random() < share_right(compute_level_n(rule, state)))
        shares.append(share_right(to_newton(float(np.mean(state.reversal_levels_db[-90:])))))
    assert np.mean(shares) == pytest.approx(target, abs=0.012)


@pytest.mark.slow
def test_the_step_at_the_third_reversal_moves_the_threshold(published):
    """Why it is a field of the protocol: half a decibel and more between two readings of one sentence."""
    share_right = weibull(10**-0.5, 2.0)
    after, _ = measured(published, share_right, seed=4)
    at, _ = measured(replace(published, step_change=type(published.step_change).AT_REVERSAL), share_right, seed=4)
    assert 0.4 < np.mean(20 * np.log10(after)) - np.mean(20 * np.log10(at)) < 1.5
