"""The figure of the primary analysis: medians with intervals, one-sided bounds, people, and the direction limit."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.figures.medians import draw_medians
from analysis.figures.style import MARKERS
from analysis.psychophysics.hierarchy.primary import PrimaryAnalysis, compute_primary_analysis
from analysis.psychophysics.power.simulated_study import Crowd, simulate_study
from tests.analysis.conftest import PUBLISHED

CAP_N = PUBLISHED.cap_n


@pytest.fixture(scope="module")
def primary() -> PrimaryAnalysis:
    """Six people, whose median is far above the cap at the highest of three frequencies."""
    study = simulate_study(Crowd((5.0, 25.0, 45.0), (0.4, 1.0, 7.0)), PUBLISHED, 6, (3,))
    found = compute_primary_analysis(study.answers, CAP_N)
    assert found is not None and [median.above_cap for median in found.medians] == [False, False, True]
    return found


def find_arrows(axes, colour):
    return [
        text for text in axes.texts if text.arrow_patch is not None and text.arrow_patch.get_edgecolor()[:3] == colour
    ]


def test_medians_below_the_cap_have_their_intervals_and_above_it_an_arrow_from_the_bound(primary):
    axes = draw_medians(primary, CAP_N).axes[0]
    bars = [container.lines[2][0].get_segments()[0] for container in axes.containers]
    assert len(bars) == 2
    for place, (bar, median) in enumerate(zip(bars, primary.medians, strict=False)):
        np.testing.assert_allclose(bar, [[place, median.lower_n], [place, median.upper_n]])
    (arrow,) = find_arrows(axes, (0.0, 0.0, 0.0))
    assert arrow.xyann == pytest.approx((2, primary.medians[2].lower_n))
    sizes = [line for line in axes.lines if line.get_marker() == "_" and line.get_markersize() > 20]
    assert [float(line.get_ydata()[0]) for line in sizes] == pytest.approx(
        [median.newton for median in primary.medians[:2]]
    )


def test_people_keep_their_markers_and_stand_hollow_above_the_cap(primary):
    axes = draw_medians(primary, CAP_N).axes[0]
    shown = [line for line in axes.lines if line.get_marker() in MARKERS and line.get_markersize() == 6]
    assert [line.get_marker() for line in shown[::3]] == list(MARKERS[:6])
    for line, (value, above) in zip(
        shown, [pair for p in primary.persons for pair in zip(p.thresholds_n, p.above_cap, strict=True)], strict=True
    ):
        assert (line.get_markerfacecolor() == "white") == above
        assert float(line.get_ydata()[0]) == pytest.approx(1.12 * CAP_N if above else value)
    assert axes.get_ylim()[1] > 1.12 * CAP_N


def test_a_person_is_drawn_at_the_frequencies_with_answers_alone(primary):
    gone = (primary.persons[2].subject, 25.0)
    runs = tuple(run for run in primary.runs if (run.subject, run.frequency_hz) != gone)
    assert len(runs) == len(primary.runs) - 1
    axes = draw_medians(replace(primary, runs=runs), CAP_N).axes[0]
    third = [line for line in axes.lines if line.get_marker() == MARKERS[2] and line.get_markersize() == 6]
    assert [round(float(line.get_xdata()[0])) for line in third] == [0, 2]


def test_the_direction_limit_lies_on_the_cap_between_its_frequencies(primary):
    axes = draw_medians(primary, CAP_N).axes[0]
    (mark,) = [line for line in axes.lines if line.get_marker() == "D" and line.get_markersize() == 8]
    limit = primary.limit
    assert limit.frequency_hz is not None
    place = 1 + np.log(limit.frequency_hz / 25.0) / np.log(45.0 / 25.0)
    assert (mark.get_xdata()[0], mark.get_ydata()[0]) == pytest.approx((place, CAP_N))


def test_without_a_bound_the_arrow_begins_at_the_axis_and_without_a_limit_there_is_no_mark(primary):
    open_end = replace(primary.medians[2], lower_db=None)
    changed = replace(
        primary, medians=(*primary.medians[:2], open_end), limit=replace(primary.limit, frequency_hz=None)
    )
    figure = draw_medians(changed, CAP_N)
    (axes,) = figure.axes
    (arrow,) = find_arrows(axes, (0.0, 0.0, 0.0))
    assert arrow.xyann[1] == pytest.approx(axes.get_ylim()[0])
    assert not any(line.get_marker() == "D" and line.get_markersize() == 8 for line in axes.lines)
    assert not any("limit" in text.get_text() for text in figure.legends[0].get_texts())


@pytest.mark.parametrize("bound_n", [4.0, 6.0, 12.0, 400.0])
def test_the_arrow_of_a_bound_points_up_within_the_axis_however_high_the_bound_is(primary, bound_n):
    """A bound above the end of the axis drew it downwards, outside."""
    high = replace(primary.medians[2], lower_db=20.0 * np.log10(bound_n))
    axes = draw_medians(replace(primary, medians=(*primary.medians[:2], high)), CAP_N).axes[0]
    (arrow,) = find_arrows(axes, (0.0, 0.0, 0.0))
    begin, end, top = arrow.xyann[1], arrow.xy[1], axes.get_ylim()[1]
    assert begin < end <= top <= 8.0 * CAP_N
    assert begin == pytest.approx(bound_n) or top == 8.0 * CAP_N


def test_where_all_are_above_the_cap_the_axis_shows_the_cap_and_points_up(primary):
    """It began at 15 % below thresholds that are not drawn: above the cap, or even above its own upper end."""
    persons = tuple(replace(person, thresholds_n=(90.0,) * 3, above_cap=(True,) * 3) for person in primary.persons)
    medians = tuple(replace(each, db=39.0, lower_db=None, upper_db=None, above_cap=True) for each in primary.medians)
    limit = replace(primary.limit, frequency_hz=None)
    bottom, top = (
        draw_medians(replace(primary, persons=persons, medians=medians, limit=limit), CAP_N).axes[0].get_ylim()
    )
    assert bottom < CAP_N < top


def test_the_interval_of_a_median_near_the_cap_ends_within_the_axis(primary):
    wide = replace(primary.medians[1], upper_db=20.0 * np.log10(5.0))
    axes = draw_medians(replace(primary, medians=(primary.medians[0], wide, primary.medians[2])), CAP_N).axes[0]
    assert axes.get_ylim()[1] > 5.0


def test_no_text_is_cut_off_or_lies_on_another(primary):
    figure = draw_medians(primary, CAP_N)
    figure.draw_without_rendering()
    page = figure.bbox
    boxes = [text.get_window_extent() for text in figure.legends[0].get_texts()]
    boxes += [label.get_window_extent() for label in (*figure.axes[0].get_xticklabels(),)]
    boxes += [label.get_window_extent() for label in figure.axes[0].get_yticklabels() if label.get_text()]
    for index, box in enumerate(boxes):
        assert page.contains(*box.min) and page.contains(*box.max)
        assert not any(box.overlaps(other) for other in boxes[index + 1 :])
