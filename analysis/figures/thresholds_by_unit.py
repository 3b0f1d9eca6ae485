"""Figure of direction thresholds over frequency, one panel per unit: commanded force (N), delivered acceleration
(m/s²), displacement (mm), and dB above the detection threshold."""

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

_AXIS_LABELS: dict[Quantity, str] = {
    "threshold_n": "Commanded (N)",
    "threshold_mps2": "Delivered (m/s²)",
    "threshold_mm": "Displacement (mm)",
    "above_detection_db": "Above detection (dB)",
}
_MARKER_SPREAD_TICKS = 0.4
"""Width over which the participants' markers are spread at each frequency, in distances between ticks. Chosen."""
_MEDIAN_HALF_LENGTH = 0.32
"""Half-length of the line of a median, in distances between ticks: the line is a little wider than the markers."""
_PANEL_HEIGHT_IN, _LEGEND_HEIGHT_IN = 2.5, 0.4
"""Height of a row of panels, and of the legend above them (inches). Chosen."""
_LOWER_LIMIT_FACTOR, _UPPER_LIMIT_FACTOR = 0.8, 1.35
"""Lower limit of a logarithmic axis over the smallest value, and upper limit over the largest: chosen for the
markers."""


def draw_thresholds_by_unit(tables: Sequence[ThresholdTable]) -> Figure:
    """Draw a figure with one panel per table: each participant's thresholds in a colour and marker, and the median per
    frequency. tables: at least one, one per unit, with the same participants and frequencies, and each with at least
    one value for which `can_be_drawn` is true."""
    column_count = 2 if len(tables) > 1 else 1
    row_count = -(-len(tables) // column_count)
    figure = create_figure(PAGE_WIDTH_IN, _PANEL_HEIGHT_IN * row_count + _LEGEND_HEIGHT_IN)
    panel_axes = [axes for grid_row in figure.subplots(row_count, column_count, squeeze=False) for axes in grid_row]
    for axes, table in zip(panel_axes, tables, strict=False):
        _draw_panel(axes, table)
    for axes in panel_axes[len(tables) :]:
        axes.axis("off")
    figure.legend(
        handles=_make_legend_handles(tables), loc="outside upper center", ncols=3, fontsize=8.5, frameon=False
    )
    return figure


def can_be_drawn(threshold: float | None, quantity: Quantity) -> bool:
    """Whether a threshold can be drawn in its panel: it must not be None or, on the logarithmic axes, 0 or less, as in
    m/s² where the accelerometer reads 0. dB above detection have a linear axis and may be negative."""
    return threshold is not None and (threshold > 0 or quantity == "above_detection_db")


def _draw_panel(axes: Axes, table: ThresholdTable) -> None:
    """Draw one panel; values that are missing or cannot be drawn are gaps. Medians are those of the drawn values."""
    style_axes(axes)
    drawable_values = [
        [threshold if can_be_drawn(threshold, table.quantity) else np.nan for threshold in row] for row in table.values
    ]
    thresholds = np.array(drawable_values, dtype=float)
    offsets = (
        np.linspace(-_MARKER_SPREAD_TICKS / 2, _MARKER_SPREAD_TICKS / 2, len(thresholds))
        if len(thresholds) > 1
        else np.zeros(1)
    )
    for participant, row in enumerate(thresholds):
        positions = np.arange(len(row)) + offsets[participant]
        axes.plot(positions, row, "-", color=choose_colour(participant), linewidth=0.7, alpha=0.5, zorder=1)
        for marker_position, threshold, is_censored in zip(positions, row, table.censored[participant], strict=True):
            if np.isfinite(threshold):
                draw_threshold(axes, float(marker_position), float(threshold), participant, is_censored)
    for position, frequency_values in enumerate(thresholds.T):
        if np.isfinite(frequency_values).any():
            median = float(np.nanmedian(frequency_values))
            axes.plot(
                [position - _MEDIAN_HALF_LENGTH, position + _MEDIAN_HALF_LENGTH],
                [median, median],
                color=BLACK,
                linewidth=2.2,
                zorder=4,
            )
    axes.set_xticks(range(len(table.frequencies_hz)), [f"{frequency_hz:g}" for frequency_hz in table.frequencies_hz])
    axes.set_xlabel("Frequency (Hz)", fontsize=9)
    axes.set_ylabel(_AXIS_LABELS[table.quantity], fontsize=9)
    if table.quantity == "above_detection_db":
        axes.axhline(0.0, color=GREY, linewidth=0.9)
        axes.margins(y=0.12)
        return
    axes.set_yscale("log")
    low, high = _LOWER_LIMIT_FACTOR * float(np.nanmin(thresholds)), _UPPER_LIMIT_FACTOR * float(np.nanmax(thresholds))
    axes.set_ylim(low, high)
    set_ratio_ticks(axes.yaxis, low, high)


def _make_legend_handles(tables: Sequence[ThresholdTable]) -> list[Line2D]:
    """Make the legend's entries: participant, median, and censored thresholds where there are any."""
    handles = [
        Line2D([], [], color=GREY, marker=choose_marker(0), linewidth=0.7, label="a participant"),
        Line2D([], [], color=BLACK, linewidth=2.2, label="median of what is shown"),
    ]
    if any(table.censored_count for table in tables):
        censored_handle = Line2D(
            [], [], color=GREY, marker=CENSORED_MARKER, linewidth=0, markersize=9, label="cut by the cap (hollow)"
        )
        handles.append(censored_handle)
    return handles
