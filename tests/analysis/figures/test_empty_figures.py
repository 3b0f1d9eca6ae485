import pytest

from analysis.figures.delivered_acceleration import draw_delivered_acceleration
from analysis.figures.ellipsoids import draw_ellipsoids
from analysis.figures.staircases import draw_staircases
from analysis.figures.thresholds import draw_thresholds
from analysis.psychophysics.anova import compute_one_way_anova
from analysis.psychophysics.comparisons import compare_group_means
from analysis.psychophysics.threshold_table import tabulate_thresholds


@pytest.mark.parametrize(
    ("draw", "sentence"),
    [
        (
            lambda rule: draw_thresholds(
                tabulate_thresholds((), (5.0,)), compare_group_means(compute_one_way_anova({})), 3.0
            ),
            "There is no completed run to draw.",
        ),
        (lambda rule: draw_staircases((), rule), "There is no run to draw."),
        (lambda rule: draw_delivered_acceleration(()), "No trial has a measured acceleration."),
        (lambda rule: draw_ellipsoids(()), "There is no ellipsoid to draw."),
    ],
)
def test_an_empty_figure_says_what_is_missing(draw, sentence, rule):
    assert [text.get_text() for text in draw(rule).texts] == [sentence]
