import itertools
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.text import Text

from analysis.figures.picture import Picture
from analysis.figures.staircases import draw_staircases
from analysis.figures.study_pictures import draw_study_pictures
from analysis.figures.style import MARKERS
from analysis.psychophysics.runs import recompute_runs
from analysis.psychophysics.study_analysis import analyse_study
from tests.analysis.conftest import PUBLISHED


@pytest.fixture(scope="module")
def draw_pictures(protocol):
    def pictures(trials) -> dict[str, Picture]:
        return {picture.name: picture for picture in draw_study_pictures(analyse_study(trials, protocol))}

    return pictures


@pytest.fixture(scope="module")
def study_trials(simulate_study):
    """The trials of a study with ten participants."""
    return simulate_study()


@pytest.fixture(scope="module")
def study_drawings(draw_pictures, study_trials):
    return draw_pictures(study_trials)


@pytest.fixture(scope="module")
def one_person_drawings(draw_pictures, simulate_study):
    return draw_pictures(simulate_study(subjects=1))


def figure_text(figure: Figure) -> str:
    figure.canvas.draw()
    return " ".join(artist.get_text() for artist in figure.findobj(lambda artist: hasattr(artist, "get_text")))


def plotted_markers(figure: Figure) -> list[str]:
    return [str(line.get_marker()) for line in figure.axes[0].lines if line.get_marker() not in ("None", "_", None)]


@pytest.mark.slow
def test_a_study_has_its_figures_in_the_order_of_the_report(draw_pictures, simulate_study):
    assert list(draw_pictures(simulate_study(subjects=3))) == [
        "thresholds", "units", "medians", "psychometric", "psychometric-1-s01", "psychometric-2-s02",
        "psychometric-3-s03", "delivered", "staircases-1-s01", "staircases-2-s02", "staircases-3-s03",
    ]  # fmt: skip


@pytest.mark.slow
def test_every_threshold_keeps_its_participants_marker_and_is_hollow_where_the_cap_cut(
    study_drawings, study_trials, protocol
):
    analysis = analyse_study(study_trials, protocol)
    shown = [line for line in study_drawings["thresholds"].figure.axes[0].lines if line.get_marker() in MARKERS]
    assert len(shown) == 50
    # Ten participants, ten markers, five frequencies: also those that the cap cut are distinguished.
    assert Counter(str(line.get_marker()) for line in shown) == Counter(dict.fromkeys(MARKERS, 5))
    hollow = [line for line in shown if line.get_markerfacecolor() == "white"]
    assert len(hollow) == sum(row.censored for row in analysis.thresholds) > 0
    arrows = [text for text in study_drawings["thresholds"].figure.axes[0].texts if text.arrow_patch is not None]
    assert len(arrows) == len(hollow)


@pytest.mark.slow
def test_each_participant_has_a_line_and_each_mean_stands_over_its_tick(study_drawings):
    axes = study_drawings["thresholds"].figure.axes[0]
    lines = [line for line in axes.lines if line.get_linestyle() == "-" and len(line.get_xdata()) == 5]
    assert len(lines) == 10
    assert [float(container.lines[0].get_xdata()[0]) for container in axes.containers] == list(axes.get_xticks())


@pytest.mark.slow
def test_a_run_that_the_trial_limit_stopped_is_drawn_and_said(simulate_study, protocol):
    limited = replace(protocol, staircase=replace(protocol.staircase, trial_limit=90))
    trials = simulate_study(subjects=3, true_n=(0.4, 0.4, 0.4, 0.4, float("inf")), rule=limited.staircase)
    pictures = {picture.name: picture for picture in draw_study_pictures(analyse_study(trials, limited))}
    figure = pictures["thresholds"].figure
    above = [line for line in figure.axes[0].lines if line.get_marker() in MARKERS and line.get_ydata()[0] > 3.0]
    assert [str(line.get_marker()) for line in above] == list(MARKERS[:2])
    assert "by the trial limit" in figure_text(figure)
    titles = [axes.get_title(loc="left") for axes in pictures["staircases-1-s01"].figure.axes]
    assert "45 Hz (stopped by the trial limit)" in titles


def test_a_returning_participant_has_panels_that_name_the_session(protocol, simulate_study):
    """Both sessions have a run at each frequency."""
    first = recompute_runs(simulate_study(subjects=1), protocol.staircase)
    runs = [*(replace(run, session=f"{run.session}_second") for run in first), *first]
    titles = [axes.get_title(loc="left") for axes in draw_staircases(runs, protocol.staircase).axes]
    alone = [axes.get_title(loc="left") for axes in draw_staircases(first, protocol.staircase).axes]
    name = first[0].session
    pairs = [(f"Session {name}\n{title}", f"Session {name}_second\n{title}") for title in alone if title]
    assert [title for title in titles if title] == list(itertools.chain.from_iterable(pairs))


def test_titles_of_staircases_do_not_run_into_each_other(simulate):
    """Those of two runs that the trial limit stopped did."""
    rule = replace(PUBLISHED, trial_limit=12)
    trials = [
        trial
        for run, hz in enumerate((5.0, 12.5, 35.0))
        for trial in simulate(0.6, np.random.default_rng(run), rule=rule, run=run, frequency_hz=hz)
    ]
    figure = draw_staircases(recompute_runs(trials, rule), rule)
    figure.draw_without_rendering()
    titles = [text for text in figure.findobj(Text) if "stopped by the trial limit" in text.get_text()]
    boxes = sorted((title.get_window_extent() for title in titles), key=lambda box: box.x0)
    assert len(boxes) == 3
    assert all(left.x1 < right.x0 for left, right in itertools.pairwise(boxes))


def test_the_threshold_figure_says_its_units_cap_and_intervals(study_drawings):
    said = figure_text(study_drawings["thresholds"].figure)
    for words in (
        "Frequency (Hz)",
        "(N)",
        "cap 3 N",
        "comparison interval",
        "cut by the cap",
        "without coverage",
        "s10",
    ):
        assert words in said


@pytest.mark.slow
def test_means_carry_the_comparison_intervals(study_drawings, study_trials, protocol):
    axes = study_drawings["thresholds"].figure.axes[0]
    drawn = [
        (float(segment[0, 1]), float(segment[1, 1]))
        for container in axes.containers
        for bars in container.lines[2]
        for segment in bars.get_segments()
    ]
    intervals = analyse_study(study_trials, protocol).comparisons.intervals
    assert drawn == [pytest.approx((interval.lower, interval.upper)) for interval in intervals]


@pytest.mark.slow
def test_one_participant_has_means_without_an_interval(one_person_drawings):
    figure = one_person_drawings["thresholds"].figure
    assert "comparison interval" not in figure_text(figure)


def test_a_panel_per_frequency_marks_every_reversal_and_the_threshold(one_person_drawings):
    figure = one_person_drawings["staircases-1-s01"].figure
    titles = [axes.get_title(loc="left").split(":")[0] for axes in figure.axes]
    assert {*titles} >= {"5 Hz", "15 Hz", "25 Hz", "35 Hz", "45 Hz"}
    *_, all_reversals, averaged, threshold = figure.axes[0].lines
    assert (len(all_reversals.get_xdata()), len(averaged.get_xdata())) == (13, 10)
    assert threshold.get_ydata()[0] == pytest.approx(sum(averaged.get_ydata()) / 10)
    assert f": {threshold.get_ydata()[0]:.2f} N" in figure.axes[0].get_title(loc="left")
    assert "Level (N)" in figure_text(figure)


def test_a_run_that_was_broken_off_is_drawn_and_said(draw_pictures, simulate_study):
    trials = [trial for trial in simulate_study(subjects=1) if trial.run == 1 and trial.trial <= 9]
    pictures = draw_pictures(trials)
    assert "thresholds" not in pictures
    assert "(not complete)" in pictures["staircases-1-s01"].figure.axes[0].get_title(loc="left")


def test_delivered_acceleration_has_its_units_and_both_parts(one_person_drawings):
    said = figure_text(one_person_drawings["delivered"].figure)
    for words in ("Measured (m/s²)", "Level (N)", "along the direction", "off the direction"):
        assert words in said


def test_nothing_to_show_draws_nothing(draw_pictures):
    assert draw_pictures([]) == {}
