"""The model of all answers runs on the frequencies that were played, and the report names the others."""

import json
from dataclasses import replace

import numpy as np
import pytest

from analysis.psychophysics.hierarchy.answers import count_answers
from analysis.psychophysics.hierarchy.primary import primary_analysis
from analysis.psychophysics.study_analysis import analyse_study, anova_document
from analysis.reports.study_report import render_study_report
from protocols.definition.declared_analysis import AnalysisSettings
from protocols.trial import TrialStatus

PLAYED = (5.0, 25.0, 45.0)
LOW = (0.2, 0.2, 0.3, 0.5, 0.8)


@pytest.fixture(scope="module")
def trials(simulate_study):
    return simulate_study(subjects=4, true_n=LOW)


def without(trials, *frequencies_hz):
    return [trial for trial in trials if trial.frequency_hz not in frequencies_hz]


def test_the_model_is_that_of_a_protocol_with_the_played_frequencies_alone(trials):
    played = without(trials, 15.0, 35.0)
    found = primary_analysis(count_answers(played, (5.0, 15.0, 25.0, 35.0, 45.0)), 3.0)
    alone = primary_analysis(count_answers(played, PLAYED), 3.0)
    assert found.missing_hz == (15.0, 35.0) and alone.missing_hz == ()
    assert found.frequencies_hz == PLAYED
    assert found.contrasts == alone.contrasts
    assert [median.db for median in found.medians] == [median.db for median in alone.medians]
    assert [run.frequency_hz for run in found.runs] == [run.frequency_hz for run in alone.runs]
    np.testing.assert_array_equal(found.persons[0].thresholds_n, alone.persons[0].thresholds_n)


def test_the_report_names_the_missing_and_both_analyses_compare_with_the_lowest_played(trials, protocol):
    analysis = analyse_study(without(trials, 5.0), protocol)
    assert analysis.compared.startswith("The model leaves 5 Hz out, where there is no answer yet.")
    assert {contrast.against_hz for contrast in (*analysis.primary.contrasts, *analysis.mean_contrasts)} == {15.0}
    assert [contrast.frequency_hz for contrast in analysis.mean_contrasts] == [25.0, 35.0, 45.0]
    assert "Differences to 15 Hz by the model and by reversal means" in analysis.compared
    assert "The model leaves 5 Hz out" in render_study_report(analysis, (), {}, "2026-01-02T03:04:05Z")
    assert json.loads(json.dumps(anova_document(analysis), allow_nan=False))["primary"]["missing_hz"] == [5.0]


def test_a_frequency_with_broken_runs_alone_has_no_reversal_means_to_compare(trials, protocol):
    broken = [t for t in trials if t.frequency_hz != 5.0 or t.trial <= 8]
    analysis = analyse_study(broken, protocol)
    assert analysis.primary.missing_hz == () and analysis.mean_contrasts == ()
    assert "Reversal means tell no difference to 5 Hz yet" in analysis.compared
    assert "agree within" not in analysis.compared


def test_void_trials_are_no_answers(trials):
    void = [replace(t, status=TrialStatus.SPOILED) if t.frequency_hz == 15.0 else t for t in trials]
    assert primary_analysis(count_answers(void, (5.0, 15.0)), 3.0) is None


def test_a_declared_contrast_with_a_missing_frequency_is_not_known(trials, protocol):
    declared = replace(protocol, analysis=AnalysisSettings("hierarchical", (45.0, 35.0)))
    by_model, _ = analyse_study(without(trials, 35.0), declared).declared_result.results
    assert by_model.difference is None
    assert by_model.notes == ("There is no answer at 35 Hz yet.",)
