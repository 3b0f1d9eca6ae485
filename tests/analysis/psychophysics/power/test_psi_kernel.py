"""The compiled run by Psi is the rule of `step`, and its thresholds are those of an analysed session."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.psychophysics.hierarchy.curve import NEPER_PER_DB, T_AT_THRESHOLD, Family
from analysis.psychophysics.power.compare_rules import estimate_db
from analysis.psychophysics.power.psi_kernel import pack_psi, play_psi
from analysis.psychophysics.power.simulated_study import Crowd, simulate_study
from analysis.psychophysics.power.staircase_kernel import MOST_TRIALS, Participant, Track
from protocols.definition.staircase_rule import BayesianPlacement
from protocols.procedure.psi import compute_posterior, estimate_threshold
from protocols.procedure.staircase import begin_staircase, is_finished, step, to_db
from tests.analysis.conftest import PUBLISHED
from tests.slow_instances import slow, slow_after

PSI = replace(PUBLISHED, bayesian=BayesianPlacement(60))
RULES = [
    PSI,
    replace(PUBLISHED, bayesian=BayesianPlacement(90, spread_db=2.0)),
    replace(PUBLISHED, start_n=0.37, cap_n=1.7, bayesian=BayesianPlacement(25)),
]


@pytest.mark.parametrize("rule", [RULES[0], *slow(RULES[1]), RULES[2]])
@pytest.mark.parametrize("threshold_n", slow_after(1, [0.2, 1.5, 30.0]))
def test_levels_and_estimates_are_those_of_step(rule, threshold_n):
    cap_db = to_db(rule.cap_n)
    for seed in range(8):
        track = Track(*(np.empty(MOST_TRIALS) for _ in range(3)), np.full(rule.reversals, np.nan))
        who = Participant(T_AT_THRESHOLD[Family.WEIBULL], 2.0 * NEPER_PER_DB, to_db(threshold_n), 0.02, 0.1, 0)
        trials, _, mean_db, above = play_psi(pack_psi(rule), who, seed, track)
        state = begin_staircase(rule)
        for index in range(trials):
            assert not is_finished(rule, state)
            assert track.level_db[index] == pytest.approx(state.level_db, abs=1e-9)
            state = step(rule, state, bool(track.correct[index]))
        assert is_finished(rule, state)
        expected = estimate_threshold(compute_posterior(state.answered, cap_db), cap_db)
        assert (mean_db, above) == pytest.approx((expected.mean_db, expected.above_cap), abs=1e-9)
        assert min(mean_db, cap_db) == pytest.approx(estimate_db(rule, state), abs=1e-9)


def test_a_study_by_psi_has_its_trials_and_unbiased_thresholds():
    crowd = Crowd((5.0, 45.0), (0.6, 30.0), person_sd_db=0.0, frequency_sd_db=0.0)
    study, again = (simulate_study(crowd, PSI, 100, (4,)) for _ in range(2))
    np.testing.assert_array_equal(study.threshold_db, again.threshold_db)
    assert study.trials == 100 * 2 * 60
    # The error of such a run is 1.8 dB (docs/statistics.md), so that of a mean of 100 is 0.18 dB.
    assert study.threshold_db[:, 0].mean() == pytest.approx(to_db(0.6), abs=0.6)
    assert not study.cap_reversals[:, 0].any()
    # 30 N is far above the cap: the mean stays at the cap, and is marked.
    np.testing.assert_allclose(study.threshold_n[:, 1], 3.0, atol=0.6)
    assert study.cap_reversals[:, 1].mean() > 0.95


def test_what_people_are_like_counts_under_psi_too():
    """Who guesses has no threshold below the cap."""
    crowd = Crowd((5.0,), (0.6,), guessers=1.0)
    assert simulate_study(crowd, PSI, 30, (4,)).cap_reversals.mean() > 0.9
