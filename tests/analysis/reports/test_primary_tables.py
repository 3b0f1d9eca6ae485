"""What the report says beside the numbers of the primary analysis."""

from dataclasses import replace

import pytest

from analysis.psychophysics.hierarchy.primary import compute_primary_analysis
from analysis.psychophysics.power.simulated_study import Crowd, simulate_study
from analysis.reports.primary_tables import describe_undetermined
from protocols.definition.staircase_rule import BayesianPlacement
from tests.analysis.conftest import PUBLISHED


def test_slopes_that_few_answers_do_not_tell_are_not_to_be_used():
    """Three people, 30 trials a run: their answers are as probable with a median slope of 90."""
    rule = replace(PUBLISHED, bayesian=BayesianPlacement(30))
    primary = compute_primary_analysis(simulate_study(Crowd((5.0, 45.0), (0.7, 0.7)), rule, 3, (8, 2)).answers, 3.0)
    assert primary is not None and primary.slope > 20.0
    words = describe_undetermined(primary)
    assert "differ in their slopes: the search ended at its bound" in words and "Do not use the median slope" in words


@pytest.mark.slow
def test_nothing_is_said_where_the_answers_tell_it():
    primary = compute_primary_analysis(simulate_study(Crowd((5.0, 45.0), (0.7, 0.7)), PUBLISHED, 8, (1,)).answers, 3.0)
    assert primary is not None and describe_undetermined(primary) == ""
