"""The figure of a power simulation."""

import numpy as np
import pytest

from analysis.figures.power_curves import make_power_picture
from analysis.figures.style import PAGE_WIDTH_IN
from analysis.psychophysics.power.power_curve import PowerPoint, Share


def point(people: int) -> PowerPoint:
    found = Share(people / 50, people / 50 - 0.05, people / 50 + 0.04)
    return PowerPoint(people, 200, 300.0, found, Share(0.3, 0.25, 0.36), Share(0.1, 0.07, 0.15), found, 0.1, -0.2)


def test_each_analysis_has_a_curve_with_the_interval_of_its_shares():
    above, below = make_power_picture([point(10), point(30)], 3.0, (45.0, 5.0)).figure.axes
    model, means, published = above.containers
    np.testing.assert_allclose(model.lines[0].get_ydata(), [20, 60])
    np.testing.assert_allclose(means.lines[0].get_ydata(), [30, 30])
    np.testing.assert_allclose(published.lines[0].get_ydata(), [10, 10])
    low, high = model.lines[2][0].get_segments()[0][:, 1]
    assert (low, high) == pytest.approx((15, 24))
    np.testing.assert_allclose(below.containers[0].lines[0].get_ydata(), [20, 60])


@pytest.mark.parametrize(("effect_db", "level"), [(3.0, 80.0), (0.0, 5.0)])
def test_the_line_is_the_power_asked_for_or_without_an_effect_the_level_of_the_test(effect_db, level):
    picture = make_power_picture([point(10)], effect_db, (45.0, 5.0))
    assert f"Grey lines: {level:g} %, " in picture.caption
    above, _ = picture.figure.axes
    assert any(np.allclose(line.get_ydata(), [level, level]) for line in above.lines)


def test_the_caption_says_that_without_an_effect_each_find_is_an_error():
    assert "type-1 error" in make_power_picture([point(10)], 0.0, (45.0, 5.0)).caption
    assert "finds the difference" in make_power_picture([point(10)], 3.0, (45.0, 5.0)).caption


def test_it_is_as_wide_as_the_other_figures_for_a_paper():
    assert make_power_picture([point(10)], 3.0, (45.0, 5.0)).figure.get_size_inches()[0] == PAGE_WIDTH_IN


def test_the_title_says_which_frequencies_are_compared():
    assert "3 dB between 45 and 35 Hz" in make_power_picture([point(10)], 3.0, (45.0, 35.0)).title


def test_markers_of_a_single_size_stay_together():
    above, below = make_power_picture([point(10)], 3.0, (45.0, 5.0)).figure.axes
    places = [container.lines[0].get_xdata()[0] for container in above.containers]
    low, high = below.get_xlim()
    assert np.ptp(places) < 0.1 * (high - low)


def test_means_of_runs_are_named_as_what_they_are():
    picture = make_power_picture([point(10)], 3.0, (45.0, 5.0), "Psi's posterior means")
    assert picture.figure.axes[0].get_legend_handles_labels()[1][1] == "Psi's posterior means, paired"
    assert "by Psi's posterior means" in picture.alternative
