"""Individual thresholds and group means by frequency (the published figure 2)."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from analysis.comparisons import Comparisons
from analysis.figures.style import (
    BLACK,
    CENSORED_MARKER,
    COLOURS,
    GREY,
    MARKERS,
    new_figure,
    plain_axes,
    say_nothing_to_draw,
)
from analysis.threshold_table import ThresholdTable

_SPREAD = 0.5
"""Width taken by the participants of one frequency, in steps between frequencies."""
_LEGEND_LIMIT = 24


def draw_thresholds(table: ThresholdTable, comparisons: Comparisons, cap_n: float) -> Figure:
    """Every participant at a fixed place left of the group mean; lower bounds as upward triangles.

    table: thresholds in newtons. comparisons: of the same table; without intervals plain means are drawn.
    """
    figure = new_figure(8.6, 4.8)
    if not table.subjects:
        return say_nothing_to_draw(figure, "There is no completed run to draw.")
    axes = figure.add_subplot()
    plain_axes(axes)
    axes.axhline(cap_n, color=GREY, linestyle="--", linewidth=1.2)
    axes.annotate(
        f"cap {cap_n:g} N", (1, cap_n), xycoords=("axes fraction", "data"), xytext=(-4, 4), textcoords="offset points",
        ha="right", fontsize=9, color=GREY,
    )  # fmt: skip
    _draw_participants(axes, table)
    _draw_means(axes, table, comparisons)
    axes.set_xticks(range(len(table.frequencies_hz)), [f"{f:g}" for f in table.frequencies_hz])
    axes.set_xlim(-0.6, len(table.frequencies_hz) - 0.4)
    axes.set_ylim(0, 1.12 * cap_n)
    axes.set_xlabel("Frequency (Hz)")
    axes.set_ylabel("Threshold (N)")
    figure.legend(handles=_legend(table, comparisons), loc="outside right upper", fontsize=8.5, frameon=False)
    return figure


def _draw_participants(axes: Axes, table: ThresholdTable) -> None:
    count = len(table.subjects)
    # Fixed places instead of jitter: the same participant stands at the same place at every frequency.
    places = np.linspace(-_SPREAD / 2, _SPREAD / 2, count) if count > 1 else np.zeros(1)
    for index, (row, bounds) in enumerate(zip(table.values, table.censored, strict=True)):
        for at, (value, censored) in enumerate(zip(row, bounds, strict=True)):
            if value is not None:
                marker = CENSORED_MARKER if censored else _marker(index)
                axes.plot(at - 0.09 + places[index], value, marker, color=_colour(index), markersize=6, alpha=0.85,
                          markeredgecolor="white", markeredgewidth=0.5)  # fmt: skip


def _draw_means(axes: Axes, table: ThresholdTable, comparisons: Comparisons) -> None:
    intervals = {interval.name: interval for interval in comparisons.intervals}
    for at, (name, values) in enumerate(table.groups().items()):
        present = [value for value in values if value is not None]
        if not present:
            continue
        mean = float(np.mean(present))
        half = intervals[name].upper - mean if name in intervals else None
        axes.errorbar(at + 0.34, mean, yerr=half, fmt="_", color=BLACK, markersize=13, markeredgewidth=2.2,
                      elinewidth=1.6, capsize=4)  # fmt: skip


def _legend(table: ThresholdTable, comparisons: Comparisons) -> list[Line2D]:
    percent = f"{100 * comparisons.confidence:g} %"
    mean = f"mean, {percent}\ncomparison interval" if comparisons.intervals else "mean"
    handles = [
        Line2D([], [], color=BLACK, marker="_", markersize=12, markeredgewidth=2.2, linewidth=0, label=mean),
        Line2D([], [], color=GREY, marker=CENSORED_MARKER, linewidth=0, label="lower bound\n(cut by the cap)"),
    ]
    if len(table.subjects) <= _LEGEND_LIMIT:
        handles += [
            Line2D([], [], color=_colour(index), marker=_marker(index), linewidth=0, label=subject)
            for index, subject in enumerate(table.subjects)
        ]
    return handles


def _colour(index: int) -> str:
    return COLOURS[index % len(COLOURS)]


def _marker(index: int) -> str:
    return MARKERS[index % len(MARKERS)]
