"""The compiled staircase is the rule of `step`, and its participants are those of the model."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import norm

from analysis.psychophysics.hierarchy.curve import NEPER_PER_DB, T_AT_THRESHOLD, Family, differentiate_evidence
from analysis.psychophysics.power.simulated_study import FAMILIES, Crowd, simulate_study
from analysis.psychophysics.power.staircase_kernel import (
    MOST_TRIALS,
    Participant,
    Track,
    compute_evidence,
    pack_rule,
    simulate_staircase,
)
from protocols.definition.staircase_rule import StaircaseRule, StepChange, StepPhase
from protocols.procedure.staircase import begin_staircase, is_finished, step
from tests.analysis.conftest import PUBLISHED

THREE = (StepPhase(8.0, 1), StepPhase(4.0, 2), StepPhase(2.0, 5))
RULES = [
    PUBLISHED,
    *(replace(PUBLISHED, step_change=change) for change in StepChange),
    replace(PUBLISHED, initial_one_up_one_down=True),
    replace(PUBLISHED, trial_limit=40),
    *(StaircaseRule(0.5, 2.0, 2, 2, THREE, 8, 6, step_change=change) for change in StepChange),
]


@pytest.mark.parametrize("rule", RULES)
@pytest.mark.parametrize("threshold_n", [0.2, 1.5, 30.0])
def test_levels_and_reversals_are_those_of_step(rule, threshold_n):
    for seed in range(25):
        level, side, right = np.empty(MOST_TRIALS), np.empty(MOST_TRIALS), np.empty(MOST_TRIALS)
        turns = np.full(rule.reversals, np.nan)
        who = Participant(T_AT_THRESHOLD[Family.WEIBULL], 2.0 * NEPER_PER_DB, 20 * np.log10(threshold_n), 0.02, 0.1, 0)
        trials, reversals, *_ = simulate_staircase(pack_rule(rule), who, seed, Track(level, side, right, turns))
        state = begin_staircase(rule)
        for index in range(trials):
            assert not is_finished(rule, state)
            assert level[index] == pytest.approx(state.level_db, abs=1e-9)
            state = step(rule, state, bool(right[index]))
        assert is_finished(rule, state)
        np.testing.assert_allclose(turns[:reversals], state.reversal_levels_db, atol=1e-9)


@pytest.mark.parametrize("family", FAMILIES)
def test_the_compiled_evidence_is_that_of_the_analysis(family):
    t = np.linspace(-8.0, 3.0, 45)
    compiled = [compute_evidence(x, FAMILIES.index(family)) for x in t]
    np.testing.assert_allclose(compiled, differentiate_evidence(t, family)[0], atol=1e-7)


@pytest.mark.parametrize("family", FAMILIES)
def test_far_above_threshold_errors_become_as_rare_as_the_family_says(family):
    """Beyond t = 3.2 too, where only a Weibull participant is sure: a logistic one still errs in 2 %."""
    t = np.linspace(0.0, 10.0, 51)
    errors = norm.sf([compute_evidence(x, FAMILIES.index(family)) for x in t])
    np.testing.assert_allclose(errors, norm.sf(differentiate_evidence(t, family)[0]), rtol=1e-6, atol=1.2e-11)


def test_shares_are_those_of_the_model_with_lapses_and_a_criterion():
    """At a level that never moves: one step of almost nothing."""
    rule = StaircaseRule(1.0, 1.0, 10, 10, (StepPhase(1e-6, 100),), 100, 10, trial_limit=1900)
    level, side, right = np.empty(MOST_TRIALS), np.empty(MOST_TRIALS), np.empty(MOST_TRIALS)
    counts = np.zeros((2, 2))
    for seed in range(10):
        who = Participant(T_AT_THRESHOLD[Family.WEIBULL], 2.0 * NEPER_PER_DB, 0.0, 0.05, 0.4, 0)
        n, *_ = simulate_staircase(pack_rule(rule), who, seed, Track(level, side, right, np.empty(100)))
        for index, sign in enumerate((1.0, -1.0)):
            shown = side[:n] == sign
            counts[index] += shown.sum(), right[:n][shown].sum()
    q = differentiate_evidence(np.array([T_AT_THRESHOLD[Family.WEIBULL]]), Family.WEIBULL)[0][0]
    expected = 0.05 + 0.9 * norm.cdf([q - 0.4, q + 0.4])
    error = np.sqrt(expected * (1 - expected) / counts[:, 0])
    assert np.all(np.abs(counts[:, 1] / counts[:, 0] - expected) < 4 * error)


def test_a_seed_is_a_study_and_reversal_means_are_as_known():
    crowd = Crowd((5.0,), (1.0,), person_sd_db=0.0, frequency_sd_db=0.0, slope_log_sd=0.0, criterion_sd=0.0)
    first, again = (simulate_study(crowd, PUBLISHED, 300, (4,)) for _ in range(2))
    np.testing.assert_array_equal(first.threshold_db, again.threshold_db)
    assert not np.array_equal(first.threshold_db, simulate_study(crowd, PUBLISHED, 300, (5,)).threshold_db)
    # The notes of the staircase: at 1 N, slope 2, lapse 2 %, the mean is 0.06 dB too low; its spread is 1.7 dB.
    assert first.threshold_db.mean() == pytest.approx(-0.1, abs=0.4)
    assert first.threshold_db.std() == pytest.approx(1.7, abs=0.25)


def test_a_run_without_its_reversals_has_no_threshold():
    study = simulate_study(Crowd((45.0,), (100.0,)), replace(PUBLISHED, trial_limit=30), 5, (1,))
    assert np.isnan(study.threshold_n).all()
    assert study.trials == 150
