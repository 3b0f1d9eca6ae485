"""Thresholds of a person alone: recovered, covered, bounded; and what is reported of them."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.stats import norm

from analysis.figures.study_pictures import draw_study_pictures
from analysis.psychophysics.hierarchy.answers import count_cells
from analysis.psychophysics.hierarchy.curve import (
    NEPER_PER_DB,
    T_AT_THRESHOLD,
    Family,
    compute_proportion_correct,
    differentiate_evidence,
)
from analysis.psychophysics.hierarchy.likelihood_thresholds import Nuisance, _compute_likelihood_on_grid
from analysis.psychophysics.hierarchy.single_persons import fit_single_persons
from analysis.psychophysics.power.simulated_study import Crowd, simulate_study
from analysis.psychophysics.study_analysis import analyse_study, make_anova_document
from analysis.reports.study_report import render_study_report
from tests.analysis.conftest import PUBLISHED

HZ = (5.0, 15.0, 25.0)


@pytest.mark.slow
def test_thresholds_are_recovered_and_intervals_hold_them():
    errors, held = [], []
    for number in range(25):
        study = simulate_study(Crowd(HZ, (0.4, 0.7, 1.0)), PUBLISHED, 1, (5, number))
        for run, true in zip(fit_single_persons(study.answers, 3.0).runs, study.true_db[0], strict=True):
            errors.append(run.db - true)
            held.append((-99 if run.lower_db is None else run.lower_db) <= true <= (run.upper_db or 99))
    assert abs(np.mean(errors)) < 0.5  # three standard errors of 1.5 dB over 75 runs
    assert np.mean(held) >= 0.86


def test_who_feels_no_direction_has_no_size_and_a_bound():
    study = simulate_study(Crowd(HZ, (0.4, 0.7, 1e4)), PUBLISHED, 1, (6, 0))
    found = fit_single_persons(study.answers, 3.0)
    assert found.runs[2].db is None and found.runs[2].upper_db is None
    assert found.persons[0].above_cap == (False, False, True)


def test_what_is_not_known_is_averaged_over_as_an_integral_does_it():
    """Oracle: the same average by scipy's quadrature, of a run at one level."""
    answers = count_cells(
        ("a",), (5.0,), np.zeros(6, dtype=np.intp), np.zeros(6), np.tile([1.0, -1.0], 3), np.arange(6) > 1
    )
    person = Nuisance(2.0, 0.0, (0.02,), slope_log_sd=0.4, criterion_sd=0.0)
    grid, height = _compute_likelihood_on_grid(answers, 0, person, 9.5, Family.WEIBULL)
    at = int(np.argmin(np.abs(grid + 4.0)))

    def likelihood(u: float) -> float:
        t = np.array([T_AT_THRESHOLD[Family.WEIBULL] - 2.0 * np.exp(u) * NEPER_PER_DB * grid[at]])
        p = compute_proportion_correct(differentiate_evidence(t, Family.WEIBULL)[0], 0.02)[0]
        return p**4 * (1 - p) ** 2 * norm.pdf(u, scale=0.4)

    assert np.exp(height[at]) == pytest.approx(quad(likelihood, -3, 3)[0], rel=1e-3)


@pytest.mark.slow
def test_one_participant_has_thresholds_by_likelihood_in_report_document_and_figures(simulate_study, protocol):
    analysis = analyse_study(simulate_study(subjects=1), protocol)
    page = render_study_report(analysis, draw_study_pictures(analysis), {}, "2026-01-02T03:04:05Z")
    assert "Thresholds by likelihood" in page and "Single thresholds by maximum likelihood" in page
    assert len(make_anova_document(analysis)["single_persons"]["runs"]) == 5
    assert "psychometric-1-s01" in [picture.name for picture in draw_study_pictures(analysis)]


@pytest.mark.slow
def test_people_at_one_frequency_have_their_own_numbers_and_a_study_needs_none(simulate_study, protocol):
    trials = simulate_study(subjects=3)
    single = analyse_study([trial for trial in trials if trial.frequency_hz == 15.0], protocol)
    assert single.primary is None and [run.subject for run in single.single_persons.runs] == ["s01", "s02", "s03"]
    assert single.single_persons.frequencies_hz == (15.0,)
    assert analyse_study(trials, replace(protocol)).single_persons is None
