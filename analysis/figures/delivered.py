"""Figure of measured acceleration against the commanded force level, one panel per frequency, on log-log axes.

It shows whether the device is linear (points along the grey line of proportionality) and how much of its motion is
perpendicular to the commanded direction.
"""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from analysis.figures.style import (
    BLUE,
    GREY,
    PAGE_WIDTH_IN,
    VERMILLION,
    create_figure,
    create_panel_grid,
    draw_no_data_note,
    label_panel_axes,
    set_newton_ticks,
    style_axes,
)
from protocols.trial import Trial

_RASTER_FROM = 400
"""Largest number of points that are drawn as vectors; more are rasterised, because each adds a line to the SVG."""


def draw_delivered(trials: Sequence[Trial]) -> Figure:
    """Figure of acceleration amplitude (m/s²) along and perpendicular to the commanded direction, against the level
    (N). Trials that do not count or have no measured acceleration are left out; a note where none remains."""
    measured = [trial for trial in trials if trial.is_valid and trial.delivered_mps2]
    if not measured:
        return draw_no_data_note(create_figure(PAGE_WIDTH_IN, 2.0), "No trial has a measured acceleration.")
    frequencies = sorted({trial.frequency_hz for trial in measured})
    figure, panels = create_panel_grid(len(frequencies), 2.3, sharex=True)
    levels = [trial.level_n for trial in measured]
    panels[0].set_xscale("log")
    panels[0].set_xlim(0.8 * min(levels), 1.25 * max(levels))
    for panel, frequency in zip(panels, frequencies, strict=False):
        _draw_frequency(panel, [trial for trial in measured if trial.frequency_hz == frequency])
        set_newton_ticks(panel.xaxis, min(levels), max(levels))
        panel.set_title(f"{frequency:g} Hz", fontsize=10, loc="left")
    panels[-1].legend(handles=_legend_handles(), loc="center", fontsize=9, frameon=False)
    label_panel_axes(panels, len(frequencies), "Level (N)", "Measured (m/s²)")
    return figure


def _draw_frequency(axes: Axes, trials: list[Trial]) -> None:
    """One panel. The grey line is the median ratio of acceleration along the direction to level, times the level."""
    style_axes(axes)
    rasterized = len(trials) > _RASTER_FROM
    levels = np.array([trial.level_n for trial in trials])
    on_axis = np.array([trial.delivered_mps2 for trial in trials], dtype=np.float64)
    # A zero has no place on a logarithmic axis and is left out, like a missing value.
    off_axis = np.array([trial.off_axis_mps2 or np.nan for trial in trials], dtype=np.float64)
    axes.loglog(levels, on_axis, "o", color=BLUE, markersize=3, alpha=0.5, rasterized=rasterized)
    axes.loglog(levels, off_axis, "s", color=VERMILLION, markersize=3, alpha=0.5, rasterized=rasterized,
                markerfacecolor="none")  # fmt: skip
    span = np.array([levels.min(), levels.max()])
    axes.loglog(span, span * np.median(on_axis / levels), color=GREY, linewidth=1)


def _legend_handles() -> list[Line2D]:
    return [
        Line2D([], [], marker="o", color=BLUE, linewidth=0, label="along the direction"),
        Line2D([], [], marker="s", color=VERMILLION, markerfacecolor="none", linewidth=0, label="off the direction"),
        Line2D([], [], color=GREY, linewidth=1, label="proportional (median)"),
    ]
