"""Thresholds of single runs by likelihood: recovered below the cap, bounded above it."""

import numpy as np
import pytest

from analysis.psychophysics.hierarchy.answers import count_cells
from analysis.psychophysics.hierarchy.curve import Family
from analysis.psychophysics.hierarchy.likelihood_thresholds import (
    Nuisance,
    compute_likelihood_thresholds,
    convert_to_newton,
)
from analysis.psychophysics.power.simulated_study import Crowd, simulate_study
from analysis.reports.primary_tables import format_run
from tests.analysis.conftest import PUBLISHED

CAP_DB = 20 * np.log10(3.0)
SAME = {"person_sd_db": 0.0, "frequency_sd_db": 0.0, "slope_log_sd": 0.0, "criterion_sd": 0.0}


def simulate_runs(true_n, people=300):
    study = simulate_study(Crowd((35.0,), (true_n,), **SAME), PUBLISHED, people, (8,))
    return compute_likelihood_thresholds(study.answers, [Nuisance(2.0, 0.0, (0.02,))] * people, CAP_DB)


@pytest.mark.parametrize("true_n", [pytest.param(0.3, marks=pytest.mark.slow), 1.0])
def test_intervals_hold_the_truth_as_often_as_they_say(true_n):
    true_db, found = 20 * np.log10(true_n), simulate_runs(true_n)
    held = [(r.lower_db or -99) <= true_db <= (r.upper_db or 99) for r in found]
    assert 0.92 <= np.mean(held) <= 0.98  # 95 %, two and a half standard errors of 300 runs
    assert np.mean([r.db for r in found]) == pytest.approx(true_db, abs=0.4)


@pytest.mark.slow
def test_above_the_cap_there_is_a_bound():
    true_db, found = 20 * np.log10(5.0), simulate_runs(5.0)
    above = [r for r in found if r.db is None]
    assert len(above) > 0.6 * len(found)
    assert all(r.upper_db is None for r in above)
    # All runs, the one-sided bounds and the lower ends of two-sided intervals.
    assert np.mean([(r.lower_db or -99) <= true_db for r in found]) >= 0.93


def test_a_guesser_has_no_upper_end_and_newtons_are_of_decibels():
    found = simulate_runs(1e4, people=20)
    assert sum(r.upper_db is None for r in found) >= 19
    assert convert_to_newton(20.0) == pytest.approx(10.0)
    assert convert_to_newton(None) is None


def likelihood_of_run(levels_n, right, family=Family.WEIBULL, slope=2.0):
    levels_db, n = 20 * np.log10(np.asarray(levels_n)), len(levels_n)
    side = np.where(np.arange(n) % 2, 1.0, -1.0)
    answers = count_cells(("a",), (35.0,), np.zeros(n, dtype=np.intp), levels_db, side, np.asarray(right))
    (run,) = compute_likelihood_thresholds(answers, [Nuisance(slope, 0.1, (0.02,))], CAP_DB, family)
    return run


@pytest.mark.parametrize(("family", "slope"), [(Family.WEIBULL, 2.0), (Family.LOGISTIC, 1.0), (Family.GAUSS, 1.9)])
def test_right_answers_alone_give_an_upper_bound_and_no_size(family, slope):
    levels = np.repeat([1.0, 0.8, 0.5, 0.4], 3)
    run = likelihood_of_run(levels, np.ones(12, dtype=bool), family, slope)
    assert run.below and run.db is None and run.lower_db is None
    more = likelihood_of_run(np.tile(levels, 2), np.ones(24, dtype=bool), family, slope)
    assert -25.0 < more.upper_db < run.upper_db < 0.0
    size, interval = format_run(run)
    assert size == "below the levels played" and interval.startswith("below 0.")


def test_an_upper_bound_after_right_answers_alone_excludes_what_it_should():
    """At the bound, so many right answers have the probability exp(-1.92) of the highest possible: the end that a
    two-sided interval of 95 % has."""
    run = likelihood_of_run(np.full(10, 0.5), np.ones(10, dtype=bool))
    t = np.log(-np.log(2 - 2 * 0.5 ** (1 / 3))) + 2.0 * np.log(0.5 / convert_to_newton(run.upper_db))
    share = 0.02 + 0.96 * (1.0 - 0.5 * np.exp(-np.exp(t)))
    assert 10 * np.log(share / 0.98) == pytest.approx(-(1.96**2) / 2, abs=0.1)  # the criterion of 0.1 left out here


def test_one_right_answer_bounds_nothing_and_a_wrong_one_ends_the_case():
    nothing = likelihood_of_run([1.0], [True])
    assert nothing.below and nothing.upper_db is None
    assert format_run(nothing) == ("below the levels played", "–")
    some = likelihood_of_run(np.repeat([1.0, 0.5, 0.25], 4), [True] * 8 + [True, False, False, True])
    assert not some.below and some.db is not None


def test_wrong_answers_far_below_the_cap_give_no_size_either():
    run = likelihood_of_run(np.full(12, 0.02), np.zeros(12, dtype=bool))
    assert not run.below and run.db is None and run.lower_db is not None
    assert format_run(run)[0] == "above the cap"
