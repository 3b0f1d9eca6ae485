"""Figure of individual thresholds and group means by frequency (the published figure 2).

Thresholds that the cap cut (censored) are hollow with an arrow upwards; runs that the trial limit stopped have no
threshold and are drawn above the cap.
"""

from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from analysis.figures.style import (
    BLACK,
    CENSORED_MARKER,
    GREY,
    PAGE_WIDTH_IN,
    choose_colour,
    choose_height_in,
    choose_marker,
    create_figure,
    draw_no_data_note,
    make_participant_handles,
    style_axes,
)
from analysis.psychophysics.comparisons import ComparisonInterval, Comparisons
from analysis.psychophysics.threshold_table import ThresholdTable
from equalizer.signals.signal import FloatArray

_MARKER_SPREAD_TICKS = 0.5
"""Width over which the participants' markers are spread at each frequency, in distances between ticks. Chosen."""
_STOPPED_RUN_HEIGHT = 1.07
"""Height at which stopped runs are drawn, as a multiple of the cap: chosen between the cap and the end of the axis."""
_AXIS_TOP = 1.15
"""Upper end of the axis, as a multiple of the cap. Chosen."""


def draw_thresholds(table: ThresholdTable, comparisons: Comparisons, cap_n: float) -> Figure:
    """Draw each participant's thresholds, joined by a line, and the group mean with its comparison interval, with an
    arrowhead at an end of the axis that it passes.

    table: thresholds in newtons; where it has no participant, the figure contains a note. comparisons: of the same
    table; without intervals, means are drawn alone. cap_n: largest force of the study (N), a dashed line.
    """
    legend_handles = _make_legend_handles(table, comparisons, cap_n)
    figure = create_figure(PAGE_WIDTH_IN, choose_height_in(legend_handles, 4.2))
    if not table.subjects:
        return draw_no_data_note(figure, "There is no completed run to draw.")
    axes = figure.add_subplot()
    style_axes(axes)
    axes.axhline(cap_n, color=GREY, linestyle="--", linewidth=1.2)
    axes.annotate(
        f"cap {cap_n:g} N", (0, cap_n), xycoords=("axes fraction", "data"), xytext=(4, 4), textcoords="offset points",
        ha="left", fontsize=9, color=GREY,
    )  # fmt: skip
    # A fixed offset from the tick instead of random jitter: a participant has the same offset at every frequency.
    spread = _MARKER_SPREAD_TICKS / 2 if len(table.subjects) > 1 else 0.0
    offsets = np.linspace(-spread, spread, len(table.subjects))
    _draw_participants(axes, table, offsets)
    _draw_stopped_runs(axes, table, offsets, cap_n)
    _draw_means(axes, table, comparisons, cap_n)
    axes.set_xticks(range(len(table.frequencies_hz)), [f"{frequency_hz:g}" for frequency_hz in table.frequencies_hz])
    axes.set_xlim(-0.6, len(table.frequencies_hz) - 0.4)
    axes.set_ylim(0, _AXIS_TOP * cap_n)
    axes.set_xlabel("Frequency (Hz)")
    axes.set_ylabel("Threshold (N)")
    figure.legend(handles=legend_handles, loc="outside right upper", fontsize=8.5, frameon=False)
    return figure


def _draw_participants(axes: Axes, table: ThresholdTable, offsets: FloatArray) -> None:
    """Draw each participant's thresholds in a colour and marker, joined by a thin line that is broken at a gap.
    offsets: of the participants from the tick, in distances between ticks."""
    for participant, row in enumerate(table.values):
        positions = np.arange(len(row)) + offsets[participant]
        threshold_values = np.array([np.nan if threshold is None else threshold for threshold in row], dtype=float)
        axes.plot(
            positions, threshold_values, "-", color=choose_colour(participant), linewidth=0.7, alpha=0.45, zorder=1
        )
        for position, threshold, is_censored in zip(positions, row, table.censored[participant], strict=True):
            if threshold is not None:
                draw_threshold(axes, position, threshold, participant, is_censored)


def draw_threshold(axes: Axes, position: float, threshold: float, participant: int, is_censored: bool) -> None:
    """Draw the marker of one threshold; hollow with an arrow upwards if it is censored by the cap. position, threshold:
    in the units of the axes. participant: index, which determines marker and colour."""
    colour = choose_colour(participant)
    axes.plot(position, threshold, choose_marker(participant), color=colour, markersize=6, alpha=0.85,
              markerfacecolor="white" if is_censored else colour, markeredgecolor=colour if is_censored else "white",
              markeredgewidth=1.1 if is_censored else 0.5)  # fmt: skip
    if is_censored:
        axes.annotate("", (position, threshold), xytext=(0, 13), textcoords="offset points", zorder=2,
                      arrowprops={"arrowstyle": "<-", "color": colour, "linewidth": 0.9, "shrinkB": 3.5,
                                  "shrinkA": 0})  # fmt: skip


def _draw_stopped_runs(axes: Axes, table: ThresholdTable, offsets: FloatArray, cap_n: float) -> None:
    """Draw a hollow marker above the cap where a stopped run left no threshold. offsets: as in
    `_draw_participants`."""
    for person, row in enumerate(table.stopped):
        for position, is_stopped in enumerate(row):
            if is_stopped:
                axes.plot(position + offsets[person], _STOPPED_RUN_HEIGHT * cap_n, choose_marker(person), markersize=6,
                          color=choose_colour(person), markerfacecolor="none")  # fmt: skip


def _draw_means(axes: Axes, table: ThresholdTable, comparisons: Comparisons, cap_n: float) -> None:
    """Draw the mean of the thresholds at each frequency that has any, with its comparison interval if it has one, and
    an arrowhead at each end of the axis that the interval passes."""
    intervals = {interval.name: interval for interval in comparisons.intervals}
    for position, (name, thresholds) in enumerate(table.group_by_frequency().items()):
        measured_thresholds = [threshold for threshold in thresholds if threshold is not None]
        if not measured_thresholds:
            continue
        mean = float(np.mean(measured_thresholds))
        half_width = intervals[name].upper - mean if name in intervals else None
        axes.errorbar(position, mean, yerr=half_width, fmt="_", color=BLACK, markersize=22, markeredgewidth=2.4,
                      elinewidth=1.6, capsize=4, zorder=4)  # fmt: skip
        for end_n, marker in _list_passed_ends(intervals.get(name), cap_n):
            axes.plot(position, end_n, marker, color=BLACK, markersize=6, clip_on=False, zorder=4)


def _list_passed_ends(interval: ComparisonInterval | None, cap_n: float) -> list[tuple[float, str]]:
    """List the ends of the axis (N) that an interval passes, each with the marker of an arrowhead; empty without an
    interval."""
    if interval is None:
        return []
    ends = ((0.0, "v", interval.lower < 0), (_AXIS_TOP * cap_n, "^", interval.upper > _AXIS_TOP * cap_n))
    return [(end_n, marker) for end_n, marker, is_passed in ends if is_passed]


def _make_legend_handles(table: ThresholdTable, comparisons: Comparisons, cap_n: float) -> list[Line2D]:
    """Make the legend's entries: mean, intervals that pass the axis, censored and stopped runs where there are any, and
    the participants."""
    confidence_text = f"{100 * comparisons.confidence:g} %"
    coverage_note = ",\nwithout coverage" if table.coverage_warning else ""
    mean_label = f"mean, {confidence_text}\ncomparison interval{coverage_note}" if comparisons.intervals else "mean"
    handle = partial(Line2D, [], [], linewidth=0)
    handles = [handle(color=BLACK, marker="_", markersize=12, markeredgewidth=2.4, label=mean_label)]
    if any(_list_passed_ends(interval, cap_n) for interval in comparisons.intervals):
        handles.append(handle(color=BLACK, marker="v", markersize=6, label="interval passes the\naxis"))
    if table.censored_count:
        label = "cut by the cap\n(hollow marker)"
        handles.append(handle(color=GREY, marker=CENSORED_MARKER, markersize=9, label=label))
    if any(map(any, table.stopped)):
        label = "above the cap: stopped\nby the trial limit"
        handles.append(handle(color=GREY, marker="o", markerfacecolor="none", label=label))
    return [*handles, *make_participant_handles(table.subjects)]
