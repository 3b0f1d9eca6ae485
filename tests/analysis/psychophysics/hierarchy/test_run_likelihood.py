"""Thresholds of single runs by likelihood: recovered below the cap, bounded above it."""

import numpy as np
import pytest

from analysis.psychophysics.hierarchy.run_likelihood import newton_or_none, run_likelihoods
from analysis.psychophysics.power.simulated_study import Crowd, simulate_study
from tests.analysis.conftest import PUBLISHED

CAP_DB = 20 * np.log10(3.0)
SAME = {"person_sd_db": 0.0, "frequency_sd_db": 0.0, "slope_log_sd": 0.0, "criterion_sd": 0.0}


def runs(true_n, people=300):
    study = simulate_study(Crowd((35.0,), (true_n,), **SAME), PUBLISHED, people, (8,))
    return run_likelihoods(study.answers, [(2.0, 0.0)] * people, 0.02, CAP_DB)


@pytest.mark.parametrize("true_n", [0.3, 1.0])
def test_intervals_hold_the_truth_as_often_as_they_say(true_n):
    true_db, found = 20 * np.log10(true_n), runs(true_n)
    held = [(r.lower_db or -99) <= true_db <= (r.upper_db or 99) for r in found]
    assert 0.92 <= np.mean(held) <= 0.98  # 95 %, two and a half standard errors of 300 runs
    assert np.mean([r.db for r in found]) == pytest.approx(true_db, abs=0.4)


def test_above_the_cap_there_is_a_bound():
    true_db, found = 20 * np.log10(5.0), runs(5.0)
    above = [r for r in found if r.db is None]
    assert len(above) > 0.6 * len(found)
    assert all(r.upper_db is None for r in above)
    # All runs, the one-sided bounds and the lower ends of two-sided intervals.
    assert np.mean([(r.lower_db or -99) <= true_db for r in found]) >= 0.93


def test_a_guesser_has_no_upper_end_and_newtons_are_of_decibels():
    found = runs(1e4, people=20)
    assert sum(r.upper_db is None for r in found) >= 19
    assert newton_or_none(20.0) == pytest.approx(10.0)
    assert newton_or_none(None) is None
