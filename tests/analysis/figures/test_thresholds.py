from analysis.figures.style import MARKERS
from analysis.figures.thresholds import draw_thresholds
from analysis.psychophysics.comparisons import Comparisons
from analysis.psychophysics.threshold_table import ThresholdTable


def test_a_stopped_run_of_a_single_participant_stands_over_its_tick_as_the_thresholds_do():
    """It stood a quarter of a tick to the left of them."""
    table = ThresholdTable(
        "threshold_n", ("s01",), (5.0, 25.0), ((0.5, None),), ((False, False),), ((False, True),), ()
    )
    axes = draw_thresholds(table, Comparisons(0.95, None, (), (), ()), 3.0).axes[0]
    shown = [line for line in axes.lines if line.get_marker() == MARKERS[0]]
    assert [float(line.get_xdata()[0]) for line in shown] == [0.0, 1.0]
