"""What the tables of thresholds say of runs that the cap or the trial limit affected."""

from types import SimpleNamespace

import pytest

from analysis.psychophysics.anova import compute_one_way_anova
from analysis.psychophysics.comparisons import compare_group_means
from analysis.psychophysics.threshold_table import ThresholdTable
from analysis.reports.study_tables import make_group_table, make_one_way_table, make_pair_table
from tests.analysis.conftest import PUBLISHED


def test_a_mean_is_called_cut_only_where_the_cap_cut_a_threshold_of_it():
    table = ThresholdTable(
        "threshold_n", ("s1", "s2", "s3"), (5.0, 25.0, 35.0, 45.0),
        ((0.4, 0.5, 2.0, 2.0), (0.5, 0.7, 2.4, 2.4), (0.6, None, 2.2, None)),
        ((False,) * 4, (False, False, True, True), (False,) * 4),
        ((False,) * 4, (False,) * 4, (False, True, False, True)), (),
    )  # fmt: skip
    anova = compute_one_way_anova(table.group_by_frequency())
    analysis = SimpleNamespace(table=table, anova=anova, comparisons=compare_group_means(anova))
    assert [(n, mean, cut, stopped) for _, n, mean, _, _, cut, stopped in make_group_table(analysis).rows] == [
        ("3", "0.50", "0", "0"),
        ("2", "0.60 (without stopped)", "0", "1"),
        ("3", "2.20 cut", "1", "0"),
        ("2", "2.20 cut (without stopped)", "1", "1"),
    ]


@pytest.mark.parametrize(
    ("scale", "cells", "difference", "squares"),
    [
        (1.0, [("0.50", "0.10"), ("2.20", "0.20")], "+1.70", "4.335"),
        (0.01, [("0.0050", "0.001"), ("0.022", "0.002")], "+0.017", "0.00043"),
    ],
)
def test_a_study_of_small_forces_has_enough_digits(scale, cells, difference, squares):
    """With a cap of 0.05 N the thresholds had hardly any resolution, and sums of squares were 0.000."""
    values = tuple(tuple(scale * value for value in row) for row in ((0.4, 2.0), (0.5, 2.4), (0.6, 2.2)))
    no = ((False, False),) * 3
    table = ThresholdTable("threshold_n", ("s1", "s2", "s3"), (5.0, 45.0), values, no, no, ())
    anova = compute_one_way_anova(table.group_by_frequency())
    protocol = SimpleNamespace(staircase=PUBLISHED)
    analysis = SimpleNamespace(table=table, anova=anova, comparisons=compare_group_means(anova), protocol=protocol)
    assert [row[2:4] for row in make_group_table(analysis).rows] == cells
    assert [row[1] for row in make_pair_table(analysis).rows] == [difference]
    assert make_one_way_table(analysis).rows[0][1] == squares
