"""The model of all answers runs on the frequencies that were played, and the report names the others."""

import json
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import sem

from analysis.psychophysics.group_contrasts import compute_mean_errors
from analysis.psychophysics.hierarchy import primary
from analysis.psychophysics.hierarchy.answers import count_answers, count_cells
from analysis.psychophysics.hierarchy.primary import compute_primary_analysis, select_persons
from analysis.psychophysics.power.simulated_study import Crowd
from analysis.psychophysics.power.simulated_study import simulate_study as simulate_crowd
from analysis.psychophysics.study_analysis import analyse_study, make_anova_document
from analysis.reports.study_report import render_study_report
from protocols.definition.declared_analysis import AnalysisSettings
from protocols.trial import TrialStatus
from tests.analysis.conftest import PUBLISHED
from tests.references.coverage_outside_the_model import with_few

PLAYED = (5.0, 25.0, 45.0)
LOW = (0.2, 0.2, 0.3, 0.5, 0.8)


@pytest.fixture(scope="module")
def trials(simulate_study):
    return simulate_study(subjects=4, true_n=LOW)


def drop_frequencies(trials, *frequencies_hz):
    return [trial for trial in trials if trial.frequency_hz not in frequencies_hz]


@pytest.mark.slow
def test_the_model_is_that_of_a_protocol_with_the_played_frequencies_alone(trials):
    played = drop_frequencies(trials, 15.0, 35.0)
    found = compute_primary_analysis(count_answers(played, (5.0, 15.0, 25.0, 35.0, 45.0)), 3.0)
    alone = compute_primary_analysis(count_answers(played, PLAYED), 3.0)
    assert found.missing_hz == (15.0, 35.0) and alone.missing_hz == ()
    assert found.frequencies_hz == PLAYED
    assert found.contrasts == alone.contrasts
    assert [median.db for median in found.medians] == [median.db for median in alone.medians]
    assert [run.frequency_hz for run in found.runs] == [run.frequency_hz for run in alone.runs]
    np.testing.assert_array_equal(found.persons[0].thresholds_n, alone.persons[0].thresholds_n)


@pytest.mark.slow
def test_the_report_names_the_missing_and_both_analyses_compare_with_the_lowest_played(trials, protocol):
    analysis = analyse_study(drop_frequencies(trials, 5.0), protocol)
    assert analysis.comparison_text.startswith("The model leaves 5 Hz out, where there is no answer yet.")
    assert {contrast.against_hz for contrast in (*analysis.primary.contrasts, *analysis.mean_contrasts)} == {15.0}
    assert [contrast.frequency_hz for contrast in analysis.mean_contrasts] == [25.0, 35.0, 45.0]
    assert "Differences to 15 Hz by the model and by reversal means" in analysis.comparison_text
    assert "The model leaves 5 Hz out" in render_study_report(analysis, (), {}, "2026-01-02T03:04:05Z")
    assert json.loads(json.dumps(make_anova_document(analysis), allow_nan=False))["primary"]["missing_hz"] == [5.0]


@pytest.mark.slow
def test_a_frequency_with_broken_runs_alone_has_no_reversal_means_to_compare(trials, protocol):
    broken = [t for t in trials if t.frequency_hz != 5.0 or t.trial <= 8]
    analysis = analyse_study(broken, protocol)
    assert analysis.primary.missing_hz == () and analysis.mean_contrasts == ()
    assert "Reversal means give no difference to 5 Hz yet" in analysis.comparison_text
    assert "agree within" not in analysis.comparison_text


def test_void_trials_are_no_answers(trials):
    void = [replace(t, status=TrialStatus.SPOILED) if t.frequency_hz == 15.0 else t for t in trials]
    assert compute_primary_analysis(count_answers(void, (5.0, 15.0)), 3.0) is None


@pytest.mark.slow
def test_a_declared_contrast_with_a_missing_frequency_is_not_known(trials, protocol):
    declared = replace(protocol, analysis=AnalysisSettings("hierarchical", (45.0, 35.0)))
    by_model, _ = analyse_study(drop_frequencies(trials, 35.0), declared).declared_result.results
    assert by_model.difference is None
    assert by_model.notes == ("There is no answer at 35 Hz yet.",)


STUDY = simulate_crowd(Crowd((5.0, 25.0, 45.0), (0.4, 0.7, 1.0)), PUBLISHED, 10, (19, 1)).answers


@pytest.mark.parametrize("count", [0, pytest.param(8, marks=pytest.mark.slow)])
def test_what_a_single_person_played_has_no_interval(count):
    """The estimate follows the one who played, whose spread is not known: it held the truth in half of the studies."""
    found = compute_primary_analysis(with_few(STUDY, 1, count), 3.0, declared_hz=(45.0, 5.0))
    assert [c.frequency_hz for c in found.contrasts] == [25.0]
    assert found.declared_contrast is None
    assert found.medians[2].lower_db is None and found.medians[2].upper_db is None
    assert found.medians[1].lower_db < found.medians[1].db < found.medians[1].upper_db
    assert found.limit.lower_hz is None or found.limit.lower_hz > 25.0


@pytest.mark.slow
def test_few_people_at_a_frequency_count_as_few():
    few, all_of_them = compute_primary_analysis(with_few(STUDY, 3, 0), 3.0), compute_primary_analysis(STUDY, 3.0)
    assert [c.participants for c in few.contrasts] == [10, 3]
    assert few.contrasts[1].effect_size is None and few.contrasts[1].p_spread is None
    widths = [found.medians[2].upper_db - found.medians[2].lower_db for found in (few, all_of_them)]
    assert widths[0] > 1.4 * widths[1]
    assert few.overall.participants == 3 and few.overall.left_out == STUDY.subjects[3:]
    assert few.overall == replace(
        compute_primary_analysis(select_persons(STUDY, np.arange(10) < 3), 3.0).overall,
        left_out=few.overall.left_out,
        notes=few.overall.notes,
    )


def test_short_runs_of_all_are_not_few():
    """A protocol of short runs: all have as many answers as anyone."""
    short = with_few(STUDY, 0, 12)
    assert short.has_enough_answers.all()


def make_answers(counts):
    """counts: (persons, frequencies), numbers of answers."""
    run = np.repeat(np.arange(np.size(counts)), np.ravel(counts))
    subjects = tuple(f"s{number}" for number in range(len(counts)))
    side, right = np.where(np.arange(len(run)) % 2, 1.0, -1.0), np.ones(len(run), dtype=bool)
    return count_cells(subjects, PLAYED[: len(counts[0])], run, np.zeros(len(run)), side, right)


def test_whole_short_runs_are_not_few_beside_the_long_ones_of_others():
    played = make_answers([[60, 60], [16, 14], [60, 8], [8, 0], [60, 25]]).has_enough_answers
    assert played.tolist() == [[True, True], [True, True], [True, False], [False, False], [True, True]]


@pytest.mark.slow
def test_the_fit_of_the_analysis_of_variance_must_converge_too(monkeypatch):
    few = with_few(STUDY, 3, 0)
    assert compute_primary_analysis(few, 3.0).converged
    own = primary.fit_hierarchy
    monkeypatch.setattr(primary, "fit_hierarchy", lambda a, f: replace(own(a, f), converged=a.persons == 10))
    assert not compute_primary_analysis(few, 3.0).converged


def test_errors_of_means_are_the_textbooks_where_all_have_answers_and_grow_to_those_of_the_few():
    values = np.random.default_rng(4).normal(0.0, 2.0, (10, 2))
    known = np.ones((10, 2), dtype=bool)
    whole = compute_mean_errors(values, known)
    np.testing.assert_allclose(whole.error, sem(values), rtol=1e-12)
    assert whole.df.tolist() == [9.0, 9.0]
    # Seven people without answers of their own, whose values say nothing: the mean of three, weighted by 10 / 3.
    values[3:, 1], known[3:, 1] = 0.0, False
    values[:3, 1] -= values[:3, 1].mean()
    few = compute_mean_errors(values, known)
    assert few.error[1] == pytest.approx(sem(values[:3, 1] * 3 / 10))
    assert few.df.tolist() == [9.0, pytest.approx(2.0)]
    known[2, 1] = known[1, 1] = False
    assert compute_mean_errors(values, known).error[1] == np.inf


@pytest.mark.slow
def test_intervals_hold_where_few_of_the_people_played_a_frequency():
    """Of 40 studies with whole runs of two people in ten, four fifths held the truth when all ten counted."""
    crowd = Crowd((5.0, 25.0, 45.0), (0.4, 0.7, 1.0))
    true_db = 20.0 * np.log10(1.0 / 0.4)
    held = 0
    for seed in range(40):
        answers = simulate_crowd(crowd, PUBLISHED, 10, (19, 2, seed)).answers
        (found,) = compute_primary_analysis(with_few(answers, 2, 8), 3.0).contrasts[1:]
        held += found.lower_db <= true_db <= found.upper_db
    assert held >= 36
