"""Psychometric functions and thresholds in all units, as drawn."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.figures.psychometric import draw_people_curves, draw_person_curves
from analysis.figures.study_pictures import draw_study_pictures
from analysis.figures.style import PAGE_WIDTH_IN
from analysis.figures.thresholds_by_unit import draw_thresholds_by_unit
from analysis.psychophysics.detection import compute_thresholds_above_detection
from analysis.psychophysics.hierarchy.answers import count_answers
from analysis.psychophysics.hierarchy.observed_shares import compute_group_shares, compute_person_shares
from analysis.psychophysics.study_analysis import analyse_study
from analysis.psychophysics.threshold_table import tabulate_thresholds


@pytest.fixture(scope="module")
def analysis(simulate_study, protocol):
    return analyse_study(simulate_study(subjects=4), protocol)


@pytest.fixture(scope="module")
def answers(analysis):
    return count_answers(analysis.trials, analysis.primary.frequencies_hz)


def plotted_percent(axes) -> list[float]:
    return [line.get_ydata()[0] for line in axes.lines if line.get_marker() == "o"]


@pytest.mark.slow
def test_every_frequency_has_its_points_and_its_curve(analysis, answers):
    figure = draw_people_curves(answers, analysis.primary)
    for place, axes in enumerate(figure.axes[:5]):
        np.testing.assert_allclose(
            plotted_percent(axes), [100 * s.share for s in compute_group_shares(answers, analysis.primary, place)]
        )
        curve = max((line.get_ydata() for line in axes.lines), key=len)
        assert np.all(np.diff(curve) > 0)
        assert 50 < curve[0] < curve[-1] <= 100
    assert [axes.get_title(loc="left") for axes in figure.axes[:5]] == ["5 Hz", "15 Hz", "25 Hz", "35 Hz", "45 Hz"]


def test_a_persons_curve_crosses_its_threshold_line_where_it_is_written(analysis, answers):
    figure = draw_person_curves(answers, analysis.primary, 1, 3.0)
    threshold_n = analysis.primary.persons[1].thresholds_n[0]
    assert figure.axes[0].get_title(loc="left") == f"5 Hz: {threshold_n:.2f} N"
    np.testing.assert_allclose(
        plotted_percent(figure.axes[0]), [100 * s.share for s in compute_person_shares(answers, 1, 0)]
    )
    assert "above the cap" in figure.axes[4].get_title(loc="left")


@pytest.mark.slow
def test_a_study_has_them_page_wide_as_svg_and_png(analysis):
    pictures = {picture.name: picture for picture in draw_study_pictures(analysis)}
    for name in ("thresholds", "units", "psychometric", "psychometric-2-s02", "staircases-2-s02", "delivered"):
        assert pictures[name].bitmap
        assert pictures[name].figure.get_size_inches()[0] == PAGE_WIDTH_IN


def test_a_frequency_that_a_person_did_not_play_has_no_panel(analysis, answers):
    played = replace(
        answers,
        **{name: getattr(answers, name)[answers.run != 5] for name in ("run", "level_db", "side", "right", "wrong")},
    )
    titles = [axes.get_title(loc="left") for axes in draw_person_curves(played, analysis.primary, 1, 3.0).axes]
    assert not any(title.startswith("5 Hz") for title in titles)


def test_units_stand_side_by_side_with_cuts_and_medians(analysis):
    tables = [
        tabulate_thresholds(analysis.thresholds, analysis.table.frequencies_hz, q)
        for q in ("threshold_n", "threshold_mps2")
    ]
    force, acceleration = draw_thresholds_by_unit(tables).axes
    assert (force.get_ylabel(), acceleration.get_ylabel()) == ("Commanded (N)", "Delivered (m/s²)")
    cut = [text for text in force.texts if text.arrow_patch is not None]
    assert len(cut) == analysis.table.censored_count > 0
    medians = [line.get_ydata()[0] for line in force.lines if line.get_linewidth() == 2.2]
    np.testing.assert_allclose(medians, np.median(np.array(analysis.table.values), axis=0))
    # The simulated device delivers in proportion, so the picture is the same.
    np.testing.assert_allclose(
        [line.get_ydata()[0] for line in acceleration.lines if line.get_linewidth() == 2.2], 4.0 * np.array(medians)
    )


@pytest.mark.slow
def test_thresholds_of_zero_are_left_out_of_a_ratio_scale(analysis):
    """An accelerometer that says the same all the time delivers nothing, as it says."""
    table = tabulate_thresholds(analysis.thresholds, analysis.table.frequencies_hz, "threshold_mps2")
    some = replace(table, values=tuple((0.0, *row[1:]) for row in table.values))
    assert draw_thresholds_by_unit([analysis.table, some]).axes[1].get_ylim()[0] > 0
    still = tuple(replace(row, threshold_mps2=0.0, threshold_mm=0.0) for row in analysis.thresholds)
    assert "units" not in [picture.name for picture in draw_study_pictures(replace(analysis, thresholds=still))]


@pytest.mark.slow
def test_above_detection_is_the_ratio_of_both_thresholds_where_both_are(all_trial_kinds, full_protocol):
    analysis = analyse_study(all_trial_kinds, full_protocol)
    table = compute_thresholds_above_detection(analysis.table, analysis.detection_table)
    row, felt = table.values[0], analysis.detection_table.values[0][0]
    assert row[:3] == (None, None, None) and row[4] is None
    assert row[3] == pytest.approx(20 * np.log10(analysis.table.values[0][3] / felt))
    assert table.censored[0][3] == analysis.table.censored[0][3]
    cut = replace(analysis.detection_table, censored=((True,),) * len(analysis.detection_table.subjects))
    assert compute_thresholds_above_detection(analysis.table, cut).values[0][3] is None  # it would be too high
    assert "units" in [picture.name for picture in draw_study_pictures(analysis)]


@pytest.mark.slow
def test_where_nothing_was_measured_there_is_no_figure_of_units(simulate_study, protocol):
    trials = [replace(t, delivered_mps2=None, displacement_mm=None) for t in simulate_study(subjects=2)]
    assert "units" not in [picture.name for picture in draw_study_pictures(analyse_study(trials, protocol))]
