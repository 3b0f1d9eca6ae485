"""The published and the primary analysis beside each other, in words, in the page and in the document."""

import html
import json
from dataclasses import replace

import pytest

from analysis.psychophysics.coverage.coverage_words import describe_coverage
from analysis.psychophysics.coverage.measured_coverage import MEASURED_COVERAGES
from analysis.psychophysics.declared_result import NOT_CONVERGED_NOTE
from analysis.psychophysics.hierarchy.primary import FAR_ABOVE_NOTE
from analysis.psychophysics.study_analysis import analyse_study, make_anova_document
from analysis.psychophysics.two_analyses import SIMULATED_RULE, describe_comparison, describe_declaration
from analysis.reports.study_report import render_study_report
from protocols.definition.declared_analysis import AnalysisSettings
from study.workflows.results.analyze_data import format_threshold_lines


@pytest.fixture(scope="module")
def analysis(simulate_study, protocol):
    """Medians of 2.4 N at 35 Hz and 6 N at 45 Hz under a cap of 3 N."""
    return analyse_study(simulate_study(), protocol)


@pytest.mark.slow
def test_what_the_cap_hides_is_reported(analysis):
    by_model, by_means = analysis.primary.contrasts[3], analysis.mean_contrasts[3]
    assert by_model.difference_db > by_means.difference_db + 3.0
    assert "differ: at " in analysis.comparison_text
    assert "45 Hz" in analysis.comparison_text
    for name in ("means", "tukey", "one-way"):
        assert describe_coverage(MEASURED_COVERAGES, name) in analysis.comparison_text


@pytest.mark.slow
def test_numbers_simulated_with_the_published_rule_are_said_of_no_other(analysis):
    parts = analysis.primary, analysis.mean_contrasts, analysis.comparisons, analysis.table
    assert describe_comparison(*parts, SIMULATED_RULE) == analysis.comparison_text
    for other in (replace(SIMULATED_RULE, cap_n=2.0), replace(SIMULATED_RULE, down_after_right=2)):
        said = describe_comparison(*parts, other)
        assert "Near the cap the published intervals do not have" in said
        assert "Measured near the cap" not in said


def test_a_missing_lower_bound_is_reported_on_the_page_and_in_the_terminal(analysis):
    *low, high = analysis.primary.medians
    assert high.above_cap
    primary = replace(analysis.primary, medians=(*low, replace(high, lower_db=None)))
    unbounded = replace(analysis, primary=primary)
    for shown in (
        lambda a: render_study_report(a, (), {}, "2026-01-02T03:04:05Z"),
        lambda a: "".join(format_threshold_lines(a)),
    ):
        assert "no lower bound" in shown(unbounded)
        assert "no lower bound" not in shown(analysis)


def test_a_fit_that_did_not_converge_is_reported_on_the_page_and_in_the_terminal(analysis):
    unusable = replace(analysis, primary=replace(analysis.primary, converged=False))
    for shown in (
        lambda a: render_study_report(a, (), {}, "2026-01-02T03:04:05Z"),
        lambda a: "".join(format_threshold_lines(a)),
    ):
        assert NOT_CONVERGED_NOTE in shown(unusable)
        assert NOT_CONVERGED_NOTE not in shown(analysis)


@pytest.mark.slow
def test_two_people_have_medians_without_an_interval_and_not_above_the_cap(protocol, simulate_study):
    analysis = analyse_study(simulate_study(subjects=2, true_n=(0.2, 0.2, 0.3, 0.5, 0.8)), protocol)
    page, lines = (
        render_study_report(analysis, (), {}, "2026-01-02T03:04:05Z"),
        "\n".join(format_threshold_lines(analysis)),
    )
    assert f"{analysis.primary.medians[0].newton:.3f} N  no interval: too few people" in lines
    assert "above cap" not in lines
    assert "no interval: too few people" in page and "no lower bound" not in page


@pytest.mark.slow
def test_frequencies_far_above_the_cap_are_not_compared_and_the_report_says_so(protocol, simulate_study):
    guessing = float("inf")
    declared = replace(protocol, analysis=AnalysisSettings("hierarchical", (45.0, 35.0)))
    analysis = analyse_study(simulate_study(true_n=(0.3, 0.4, 0.6, guessing, guessing)), declared)
    page = html.unescape(render_study_report(analysis, (), {}, "2026-01-02T03:04:05Z"))
    said = "At 35 Hz and 45 Hz the medians lie at more than twice the cap: the differences between these are not known"
    assert said in page
    by_model = analysis.declared_result.results[0]
    assert by_model.p is None and by_model.notes == (FAR_ABOVE_NOTE,)


@pytest.mark.slow
def test_where_all_guess_no_difference_is_told(protocol, simulate_study):
    analysis = analyse_study(simulate_study(true_n=(float("inf"),) * 5), protocol)
    assert "The model gives no difference to 5 Hz." in analysis.comparison_text
    assert "Both agree" not in analysis.comparison_text and "they disagree" not in analysis.comparison_text


@pytest.mark.slow
def test_each_interval_near_the_cap_carries_the_coverage_that_was_measured_for_it(analysis, protocol, simulate_study):
    page = render_study_report(analysis, (), {}, "2026-01-02T03:04:05Z")
    for name in ("model", "means", "tobit", "tukey", "run", "one-way"):
        assert describe_coverage(MEASURED_COVERAGES, name) in html.unescape(page)
    assert [contrast.frequency_hz for contrast in analysis.tobit] == [15.0, 25.0, 35.0] and "Tobit" in page
    low = analyse_study(simulate_study(true_n=(0.2, 0.2, 0.3, 0.5, 0.8)), protocol)
    assert low.tobit == () and "Tobit" not in render_study_report(low, (), {}, "2026-01-02T03:04:05Z")


@pytest.mark.slow
def test_far_below_the_cap_the_two_agree(simulate_study, protocol):
    low = analyse_study(simulate_study(true_n=(0.2, 0.2, 0.3, 0.5, 0.8)), protocol)
    assert "agree within 1 dB" in low.comparison_text
    assert "Measured near the cap" not in low.comparison_text


def test_one_participant_leaves_the_published_analysis_alone(simulate_study, protocol):
    alone = analyse_study(simulate_study(subjects=1), protocol)
    assert alone.primary is None
    assert "only the published analysis is given" in alone.comparison_text
    assert describe_comparison(None, (), alone.comparisons, alone.table, SIMULATED_RULE) == alone.comparison_text


def test_what_was_declared_and_what_was_not_is_reported():
    assert "declares no primary analysis" in describe_declaration(AnalysisSettings())
    said = describe_declaration(AnalysisSettings("hierarchical", (45.0, 5.0), 10))
    assert "hierarchical model" in said and "45 Hz minus 5 Hz" in said and "participants: 10" in said
    assert "Not declared: exclusions." in said
    assert "pseudo-thresholds in dB, paired" in said
    assert "Tukey's of means of runs in newtons" in describe_declaration(AnalysisSettings("published"))
    assert "Not declared" not in describe_declaration(
        AnalysisSettings("published", (45.0, 5.0), 10, ("No participant is left out.",))
    )
    by_name = describe_declaration(AnalysisSettings("hierarchical", (45.0, 5.0), 10, (), "paired_t"))
    assert "Declared interval (paired_t) of the contrast: 95 %, over people's pseudo-thresholds" in by_name
    assert "Not declared: interval method, primary contrast and exclusions." in describe_declaration(
        AnalysisSettings(participants=10)
    )


def test_the_page_and_the_document_show_both(analysis):
    html = render_study_report(analysis, (), {}, "2026-01-02T03:04:05Z")
    for words in ("All answers in one model", "Median participant", "as published", "Huynh-Feldt", "Mauchly",
                  "above the cap", "Direction limit", "p (Holm)"):  # fmt: skip
        assert words in html
    document = json.loads(json.dumps(make_anova_document(analysis), allow_nan=False))
    assert document["primary"]["medians"][4]["upper_db"] is None
    assert document["primary"]["medians"][0]["lower_db"] < document["primary"]["medians"][0]["db"]
    assert document["declared"]["primary"] == "undeclared"


def test_the_direction_limit_is_between_the_frequencies_around_the_cap(analysis):
    limit = analysis.primary.limit
    assert 25.0 < limit.frequency_hz < 45.0
    assert "this cap" in limit.words


@pytest.mark.slow
def test_the_declaration_is_part_of_the_analysis(simulate_study, protocol):
    declared = replace(protocol, analysis=AnalysisSettings("hierarchical", (45.0, 5.0), 10))
    assert "Declared as primary" in analyse_study(simulate_study(subjects=3), declared).declaration
