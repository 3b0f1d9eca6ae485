import numpy as np
import pytest

from analysis.figures.style import BLACK, MARKERS, choose_colour, choose_marker, create_figure, set_newton_ticks
from analysis.figures.thresholds import draw_thresholds
from analysis.psychophysics.comparisons import ComparisonInterval, Comparisons
from analysis.psychophysics.threshold_table import ThresholdTable


def test_a_stopped_run_of_a_single_participant_stands_over_its_tick_as_the_thresholds_do():
    """It stood a quarter of a tick to the left of them."""
    table = ThresholdTable(
        "threshold_n", ("s01",), (5.0, 25.0), ((0.5, None),), ((False, False),), ((False, True),), ()
    )
    axes = draw_thresholds(table, Comparisons(0.95, None, (), (), ()), 3.0).axes[0]
    shown = [line for line in axes.lines if line.get_marker() == MARKERS[0]]
    assert [float(line.get_xdata()[0]) for line in shown] == [0.0, 1.0]


def test_two_participants_never_have_both_the_colour_and_the_marker_in_common():
    """The eleventh looked like the first, in the legend, too."""
    assert len({(choose_colour(index), choose_marker(index)) for index in range(100)}) == 100
    assert [choose_marker(index) for index in range(10)] == list(MARKERS)


@pytest.mark.parametrize("people", [1, 16, 24])
def test_the_legend_ends_within_the_figure_however_many_participants_it_lists(people):
    """From some twenty on, its end was cut off."""
    table = ThresholdTable(
        "threshold_n", tuple(f"s{number}" for number in range(people)), (5.0, 25.0), ((0.5, None),) * people,
        ((True, False),) * people, ((False, True),) * people, (),
    )  # fmt: skip
    figure = draw_thresholds(table, Comparisons(0.95, None, (), (), ()), 3.0)
    figure.draw_without_rendering()
    (legend,) = figure.legends
    assert len(legend.get_texts()) == people + 3
    assert figure.bbox.y0 < legend.get_window_extent().y0 and legend.get_window_extent().y1 < figure.bbox.y1


@pytest.mark.parametrize(
    ("lowest_n", "highest_n"),
    [(1.05, 1.8), (1.05, 1.4), (1.11, 1.19), (0.002, 0.009), (0.1, 3.0), (1e-4, 3.0), (1e-9, 3.0)],
)
def test_an_axis_of_levels_has_a_few_numbers_wherever_it_lies(lowest_n, highest_n):
    """A cap below 2 N, or that of a small device, left it without any; after right answers only, they overlapped."""
    axes = create_figure(3.0, 3.0).add_subplot()
    axes.set_yscale("log")
    axes.set_ylim(lowest_n, highest_n)
    set_newton_ticks(axes.yaxis, lowest_n, highest_n)
    ticks = np.array([float(label.get_text()) for label in axes.get_yticklabels()])
    assert 1 < len(set(ticks)) == len(ticks) < 8 and np.all((lowest_n <= ticks) & (ticks <= highest_n))


def test_an_interval_that_passes_an_end_of_the_axis_has_an_arrowhead_there():
    """It was cut off at 0 N, as if it ended there."""
    table = ThresholdTable(
        "threshold_n", ("s1", "s2"), (5.0, 25.0, 45.0), ((0.3, 1.0, 2.5), (0.5, 1.2, 2.7)), ((False,) * 3,) * 2,
        ((False,) * 3,) * 2, (),
    )  # fmt: skip
    widths = (("5 Hz", 0.4, 0.6), ("25 Hz", 1.1, 0.6), ("45 Hz", 2.6, 0.9))
    intervals = tuple(ComparisonInterval(name, mean, mean - width, mean + width) for name, mean, width in widths)
    figure = draw_thresholds(table, Comparisons(0.95, 3.0, (), intervals, ()), 3.0)
    (axes,) = figure.axes
    heads = [
        (line.get_xdata()[0], line.get_ydata()[0])
        for line in axes.lines
        if line.get_marker() in "v^" and line.get_color() == BLACK
    ]
    assert heads == [(0, 0.0), (2, axes.get_ylim()[1])]
    assert "interval passes the\naxis" in [text.get_text() for text in figure.legends[0].get_texts()]
