"""The contrast that a protocol declares is computed, by the declared analysis and the other, and shown first."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest

from analysis.psychophysics.group_contrasts import compute_contrasts, compute_pair_contrast
from analysis.psychophysics.study_analysis import analyse_study, make_anova_document
from analysis.reports.study_report import render_study_report
from protocols.definition.declared_analysis import AnalysisSettings
from study.workflows.results.analyze_data import format_threshold_lines

LOW = (0.2, 0.2, 0.3, 0.5, 0.8)
"""Far below the cap."""


@pytest.fixture(scope="module")
def trials(simulate_study):
    return simulate_study(subjects=6, true_n=LOW)


@pytest.fixture(scope="module")
def analyse_declared(trials, protocol):
    def analyse(*declared, left_out=()):
        return analyse_study(trials, replace(protocol, analysis=AnalysisSettings(*declared)), left_out)

    return analyse


@pytest.fixture(scope="module")
def hierarchical_declared(analyse_declared):
    settings = "hierarchical", (45.0, 35.0), 10, ("Who stops early is left out.",)
    return analyse_declared(*settings, left_out=("S07 was withdrawn by the participant.",))


def page_text(analysis):
    html = render_study_report(analysis, (), {}, "2026-01-02T03:04:05Z")
    return re.sub(r"\s+", " ", re.sub(r"<[^>]+>", " ", html))


def test_a_pair_is_the_first_frequency_minus_the_second():
    values = np.array([[0.0, 1.0, 5.0], [1.0, 2.5, 5.0], [0.5, 1.0, 6.0], [0.0, np.nan, 7.0]])
    up, down = (compute_pair_contrast((5.0, 35.0, 45.0), values, pair, 0.95) for pair in ((45.0, 35.0), (35.0, 45.0)))
    assert (up.frequency_hz, up.against_hz, up.participants) == (45.0, 35.0, 3)
    assert up.difference_db == pytest.approx(np.mean([4.0, 2.5, 5.0]))
    assert (down.difference_db, down.lower_db) == pytest.approx((-up.difference_db, -up.upper_db))
    assert up.p_holm == up.p == down.p
    (as_family,) = compute_contrasts((35.0, 45.0), values[:, 1:], 0.95)
    assert as_family == up
    for none in ((), (45.0, 15.0), (45.0, 45.1)):
        assert compute_pair_contrast((5.0, 35.0, 45.0), values, none, 0.95) is None


def test_equivalence_is_asked_where_both_frequencies_are_low():
    values = np.array([[0.0, 1.0], [1.0, 2.5], [0.5, 1.0]])
    assert compute_pair_contrast((5.0, 45.0), values, (5.0, 45.0), 0.95).p_equivalence is None
    assert compute_pair_contrast((5.0, 25.0), values, (5.0, 25.0), 0.95).p_equivalence is not None


@pytest.mark.slow
def test_the_declared_contrast_is_computed_by_both_analyses_the_declared_first(hierarchical_declared, analyse_declared):
    by_model, published = hierarchical_declared.declared_result.results
    assert (by_model.analysis, by_model.declared, by_model.unit) == ("hierarchical", True, "dB")
    medians = {median.frequency_hz: median.db for median in hierarchical_declared.primary.medians}
    assert by_model.difference == pytest.approx(medians[45.0] - medians[35.0])
    assert by_model.lower < by_model.difference < by_model.upper and 0.0 < by_model.p < 1.0
    (pair,) = [p for p in hierarchical_declared.comparisons.pairs if (p.first, p.second) == ("35 Hz", "45 Hz")]
    assert (published.difference, published.lower, published.upper, published.p, published.unit) == (
        pair.difference, pair.lower, pair.upper, pair.p, "N",
    )  # fmt: skip
    first, _ = analyse_declared("published", (35.0, 45.0)).declared_result.results
    assert (first.analysis, first.declared) == ("published", True)
    assert (first.difference, first.lower, first.upper) == (-pair.difference, -pair.upper, -pair.lower)
    assert not any(row.declared for row in analyse_declared("undeclared", (35.0, 45.0)).declared_result.results)


@pytest.mark.slow
def test_the_report_begins_with_it(hierarchical_declared):
    words = page_text(hierarchical_declared)
    assert words.index("The declared result") < words.index("Before you read the numbers")
    for said in ("45 Hz minus 35 Hz, by the hierarchical model of all answers, the declared analysis: +",
                 "published one-way analysis", "Participants 10 6", "Who stops early is left out.",
                 "S07 was withdrawn by the participant."):  # fmt: skip
        assert said in words


def test_the_terminal_and_the_document_have_it(hierarchical_declared):
    printed = [
        line
        for line in format_threshold_lines(hierarchical_declared)
        if line.startswith("Declared contrast, 45 Hz minus 35 Hz")
    ]
    assert len(printed) == 2 and "declared analysis" in printed[0] and "declared analysis" not in printed[1]
    written = json.loads(json.dumps(make_anova_document(hierarchical_declared), allow_nan=False))["declared_result"]
    assert written["results"][0]["difference"] == hierarchical_declared.declared_result.results[0].difference
    assert (written["participants_declared"], written["participants_analysed"]) == (10, 6)
    assert written["left_out_count"] == 1
    assert "S07" not in json.dumps(written)  # who withdrew is named in the report alone


@pytest.mark.slow
def test_nothing_declared_takes_a_sentence(analyse_declared):
    undeclared = analyse_declared()
    assert undeclared.declared_result.results == ()
    assert undeclared.declaration.count(". ") == 0
    assert undeclared.declaration in page_text(undeclared)
    assert "Participants and exclusions" not in page_text(undeclared)
    assert not any("Declared" in line for line in format_threshold_lines(undeclared))


def test_what_the_data_do_not_tell_is_not_known(trials, protocol):
    alone = [trial for trial in trials if trial.subject == "s01"]
    analysis = analyse_study(alone, replace(protocol, analysis=AnalysisSettings("hierarchical", (45.0, 35.0))))
    by_model, published = analysis.declared_result.results
    assert by_model.difference is None and published.p is None
    assert "not known. The model needs answers of two participants" in page_text(analysis)


@pytest.mark.slow
def test_a_median_above_the_cap_leaves_a_single_end(simulate_study, protocol):
    declared = replace(protocol, analysis=AnalysisSettings("hierarchical", (45.0, 5.0)))
    by_model, published = analyse_study(simulate_study(), declared).declared_result.results
    assert by_model.notes == ("The median at 45 Hz is above the cap: the interval holds at its lower end.",)
    assert any("Without coverage" in note for note in published.notes)
