"""Figure of direction thresholds over frequency, one panel per unit: commanded force (N), delivered acceleration
(m/s²), displacement (mm), and dB above the detection threshold.

The shape of the thresholds over frequency differs between the units, because the response of the device varies with
frequency.
"""

from collections.abc import Sequence

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
    choose_marker,
    create_figure,
    set_ratio_ticks,
    style_axes,
)
from analysis.figures.thresholds import draw_threshold
from analysis.psychophysics.threshold_table import Quantity, ThresholdTable

_LABELS: dict[Quantity, str] = {
    "threshold_n": "Commanded (N)",
    "threshold_mps2": "Delivered (m/s²)",
    "threshold_mm": "Displacement (mm)",
    "above_detection_db": "Above detection (dB)",
}
_SPREAD = 0.4
"""Width over which the participants of one frequency are spread, in steps between frequencies."""
_MEDIAN_HALF_WIDTH = 0.32
"""Half-length of the line of a median, in the same steps: the line is a little wider than the participants."""
_PANEL_IN, _LEGEND_IN = 2.5, 0.4
"""Height of a row of panels, and of the legend above them (inches)."""
_ROOM_BELOW, _ROOM_ABOVE = 0.8, 1.35
"""Lower limit of a log axis over the smallest value, and upper limit over the largest value."""


def draw_thresholds_by_unit(tables: Sequence[ThresholdTable]) -> Figure:
    """Figure with one panel per table: each participant's thresholds in a colour and marker, and the median per
    frequency. tables: at least one, one per unit, with the same participants and frequencies, and each with at least
    one value for which `can_be_drawn` is true."""
    columns = 2 if len(tables) > 1 else 1
    rows = -(-len(tables) // columns)
    figure = create_figure(PAGE_WIDTH_IN, _PANEL_IN * rows + _LEGEND_IN)
    panel_axes = [axes for grid_row in figure.subplots(rows, columns, squeeze=False) for axes in grid_row]
    for axes, table in zip(panel_axes, tables, strict=False):
        _draw_table(axes, table)
    for axes in panel_axes[len(tables) :]:
        axes.axis("off")
    figure.legend(handles=_legend_handles(tables), loc="outside upper center", ncols=3, fontsize=8.5, frameon=False)
    return figure


def can_be_drawn(value: float | None, quantity: Quantity) -> bool:
    """Whether a threshold can be drawn in its panel. The axes are logarithmic and have no zero, which
    a threshold in m/s² is where the accelerometer reads nothing; dB above detection are drawn on a linear axis and may
    be negative."""
    return value is not None and (value > 0 or quantity == "above_detection_db")


def _draw_table(axes: Axes, table: ThresholdTable) -> None:
    """Draw one panel; values that are missing or cannot be drawn are gaps. Medians are those of the drawn values."""
    style_axes(axes)
    drawable = [[value if can_be_drawn(value, table.quantity) else np.nan for value in row] for row in table.values]
    values = np.array(drawable, dtype=float)
    offsets = np.linspace(-_SPREAD / 2, _SPREAD / 2, len(values)) if len(values) > 1 else np.zeros(1)
    for person, row in enumerate(values):
        positions = np.arange(len(row)) + offsets[person]
        axes.plot(positions, row, "-", color=choose_colour(person), linewidth=0.7, alpha=0.5, zorder=1)
        for x, value, cut in zip(positions, row, table.censored[person], strict=True):
            if np.isfinite(value):
                draw_threshold(axes, float(x), float(value), person, cut)
    for position, column in enumerate(values.T):
        if np.isfinite(column).any():
            median = float(np.nanmedian(column))
            axes.plot(
                [position - _MEDIAN_HALF_WIDTH, position + _MEDIAN_HALF_WIDTH],
                [median, median],
                color=BLACK,
                linewidth=2.2,
                zorder=4,
            )
    axes.set_xticks(range(len(table.frequencies_hz)), [f"{f:g}" for f in table.frequencies_hz])
    axes.set_xlabel("Frequency (Hz)", fontsize=9)
    axes.set_ylabel(_LABELS[table.quantity], fontsize=9)
    if table.quantity == "above_detection_db":
        axes.axhline(0.0, color=GREY, linewidth=0.9)
        axes.margins(y=0.12)
        return
    axes.set_yscale("log")
    low, high = _ROOM_BELOW * float(np.nanmin(values)), _ROOM_ABOVE * float(np.nanmax(values))
    axes.set_ylim(low, high)
    set_ratio_ticks(axes.yaxis, low, high)


def _legend_handles(tables: Sequence[ThresholdTable]) -> list[Line2D]:
    handles = [
        Line2D([], [], color=GREY, marker=choose_marker(0), linewidth=0.7, label="a participant"),
        Line2D([], [], color=BLACK, linewidth=2.2, label="median of what is shown"),
    ]
    if any(table.cut for table in tables):
        cut = Line2D(
            [], [], color=GREY, marker=CENSORED_MARKER, linewidth=0, markersize=9, label="cut by the cap (hollow)"
        )
        handles.append(cut)
    return handles
