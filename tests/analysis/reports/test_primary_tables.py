"""What the report says beside the numbers of the primary analysis."""

import math
from dataclasses import replace
from types import SimpleNamespace

import pytest

from analysis.psychophysics.hierarchy.objective import LOG_SLOPE_BOUNDS
from analysis.psychophysics.hierarchy.primary import compute_primary_analysis
from analysis.psychophysics.power.simulated_study import Crowd, simulate_study
from analysis.reports.primary_tables import describe_undetermined, make_primary_section
from protocols.definition.staircase_rule import BayesianPlacement
from tests.analysis.conftest import PUBLISHED


def test_slopes_that_few_answers_do_not_tell_are_not_to_be_used():
    """Three people, 30 trials a run: their answers are as probable with a median slope of 90."""
    rule = replace(PUBLISHED, bayesian=BayesianPlacement(30))
    primary = compute_primary_analysis(simulate_study(Crowd((5.0, 45.0), (0.7, 0.7)), rule, 3, (8, 2)).answers, 3.0)
    assert primary is not None and primary.slope > 20.0
    words = describe_undetermined(primary)
    assert "differ in their slopes: the search ended at its bound" in words and "Do not use the median slope" in words


@pytest.mark.parametrize(("bound", "is_said"), [(LOG_SLOPE_BOUNDS[0], True), (LOG_SLOPE_BOUNDS[1], True), (1.0, False)])
def test_a_median_slope_at_its_bound_is_not_to_be_used(primary, bound, is_said):
    """Answers of many people, all right above one level and all wrong below it, bound the spread of the slopes only."""
    words = describe_undetermined(replace(primary, slope=math.exp(bound), slope_log_sd=1.0))
    assert ("The answers do not determine the median slope: the search ended at its bound" in words) == is_said


@pytest.mark.slow
def test_nothing_is_said_where_the_answers_tell_it():
    primary = compute_primary_analysis(simulate_study(Crowd((5.0, 45.0), (0.7, 0.7)), PUBLISHED, 8, (1,)).answers, 3.0)
    assert primary is not None and describe_undetermined(primary) == ""


@pytest.fixture(scope="module")
def primary():
    return compute_primary_analysis(simulate_study(Crowd((5.0, 45.0), (0.7, 0.7)), PUBLISHED, 3, (8, 2)).answers, 3.0)


@pytest.mark.parametrize(
    ("above", "marked"),
    [
        ((False, True), "45 − 5 Hz *"),
        ((True, False), "45 − 5 Hz †"),
        ((True, True), "45 − 5 Hz * †"),
        ((False, False), "45 − 5 Hz"),
    ],
)
def test_a_median_above_the_cap_is_marked_at_either_frequency_of_a_contrast(primary, above, marked):
    medians = tuple(replace(median, above_cap=a) for median, a in zip(primary.medians, above, strict=True))
    section = make_primary_section(
        SimpleNamespace(
            primary=replace(primary, medians=medians), mean_contrasts=(), tobit=(), comparison_text="",
            protocol=SimpleNamespace(staircase=PUBLISHED), table=SimpleNamespace(coverage_warning=""),
        )
    )  # fmt: skip
    (table,) = (table for table in section.tables if table.caption == "Differences by the model (dB)")
    assert [row[0] for row in table.rows] == [marked]
    assert any("only its lower (upper) end" in note for note in table.notes) == any(above)
