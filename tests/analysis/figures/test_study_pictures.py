import pytest
from matplotlib.figure import Figure

from analysis.figures.picture import Picture
from analysis.figures.study_pictures import study_pictures
from analysis.figures.style import CENSORED_MARKER, MARKERS
from analysis.study_analysis import analyse_study


@pytest.fixture(scope="module")
def draw(protocol):
    def pictures(trials) -> dict[str, Picture]:
        return {picture.name: picture for picture in study_pictures(analyse_study(trials, protocol))}

    return pictures


@pytest.fixture(scope="module")
def ten(simulate_study):
    """The trials of a study with ten participants."""
    return simulate_study()


@pytest.fixture(scope="module")
def ten_drawn(draw, ten):
    return draw(ten)


@pytest.fixture(scope="module")
def one_drawn(draw, simulate_study):
    return draw(simulate_study(subjects=1))


def texts(figure: Figure) -> str:
    figure.canvas.draw()
    return " ".join(artist.get_text() for artist in figure.findobj(lambda artist: hasattr(artist, "get_text")))


def markers(figure: Figure) -> list[str]:
    return [str(line.get_marker()) for line in figure.axes[0].lines if line.get_marker() not in ("None", "_", None)]


def test_a_study_has_its_figures_in_the_order_of_the_report(draw, simulate_study):
    assert list(draw(simulate_study(subjects=2))) == [
        "thresholds", "delivered", "staircases-1-s01", "staircases-2-s02",
    ]  # fmt: skip


def test_every_threshold_is_a_marker_and_every_lower_bound_a_triangle(ten_drawn, ten, protocol):
    analysis = analyse_study(ten, protocol)
    shown = [marker for marker in markers(ten_drawn["thresholds"].figure) if marker in (*MARKERS, CENSORED_MARKER)]
    assert len(shown) == 50
    assert shown.count(CENSORED_MARKER) == sum(row.censored for row in analysis.thresholds)


def test_the_threshold_figure_says_its_units_cap_and_intervals(ten_drawn):
    said = texts(ten_drawn["thresholds"].figure)
    for words in ("Frequency (Hz)", "(N)", "cap 3 N", "comparison interval", "lower bound", "s10"):
        assert words in said


def test_means_carry_the_comparison_intervals(ten_drawn, ten, protocol):
    axes = ten_drawn["thresholds"].figure.axes[0]
    drawn = [
        (float(segment[0, 1]), float(segment[1, 1]))
        for container in axes.containers
        for bars in container.lines[2]
        for segment in bars.get_segments()
    ]
    intervals = analyse_study(ten, protocol).comparisons.intervals
    assert drawn == [pytest.approx((interval.lower, interval.upper)) for interval in intervals]


def test_one_participant_has_means_without_an_interval(one_drawn):
    figure = one_drawn["thresholds"].figure
    assert "comparison interval" not in texts(figure)


def test_a_panel_per_frequency_marks_every_turn(one_drawn):
    figure = one_drawn["staircases-1-s01"].figure
    assert {axes.get_title(loc="left") for axes in figure.axes} >= {"5 Hz", "15 Hz", "25 Hz", "35 Hz", "45 Hz"}
    *_, all_turns, averaged = figure.axes[0].lines
    assert (len(all_turns.get_xdata()), len(averaged.get_xdata())) == (13, 10)
    assert "Level (N)" in texts(figure)


def test_a_run_that_was_broken_off_is_drawn_and_said(draw, simulate_study):
    trials = [trial for trial in simulate_study(subjects=1) if trial.run == 1 and trial.trial <= 9]
    pictures = draw(trials)
    assert "thresholds" not in pictures
    assert "(not complete)" in pictures["staircases-1-s01"].figure.axes[0].get_title(loc="left")


def test_delivered_acceleration_has_its_units_and_both_parts(one_drawn):
    said = texts(one_drawn["delivered"].figure)
    for words in ("Measured (m/s²)", "Level (N)", "along the direction", "off the direction"):
        assert words in said


def test_nothing_to_show_draws_nothing(draw):
    assert draw([]) == {}
