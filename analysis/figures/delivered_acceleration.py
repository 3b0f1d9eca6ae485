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

_MOST_VECTOR_POINTS = 400
"""Largest number of trials of a panel whose points are drawn as vectors; more are rasterised, because each point adds a
line to the SVG. Chosen by hand."""


def draw_delivered_acceleration(trials: Sequence[Trial]) -> Figure:
    """Draw the acceleration amplitude (m/s²) along and perpendicular to the commanded direction, against the level
    (N). Invalid trials and trials without a measured acceleration, or with one of 0, are left out; the figure contains
    a note where no trial remains."""
    measured_trials = [trial for trial in trials if trial.is_valid and trial.delivered_mps2]
    if not measured_trials:
        return draw_no_data_note(create_figure(PAGE_WIDTH_IN, 2.0), "No trial has a measured acceleration.")
    frequencies_hz = sorted({trial.frequency_hz for trial in measured_trials})
    figure, panels = create_panel_grid(len(frequencies_hz), 2.3, sharex=True)
    levels_n = [trial.level_n for trial in measured_trials]
    panels[0].set_xscale("log")
    panels[0].set_xlim(0.8 * min(levels_n), 1.25 * max(levels_n))
    for panel, frequency_hz in zip(panels, frequencies_hz, strict=False):
        _draw_panel(panel, [trial for trial in measured_trials if trial.frequency_hz == frequency_hz])
        set_newton_ticks(panel.xaxis, min(levels_n), max(levels_n))
        panel.set_title(f"{frequency_hz:g} Hz", fontsize=10, loc="left")
    panels[-1].legend(handles=_make_legend_handles(), loc="center", fontsize=9, frameon=False)
    label_panel_axes(panels, len(frequencies_hz), "Level (N)", "Measured (m/s²)")
    return figure


def _draw_panel(axes: Axes, trials: list[Trial]) -> None:
    """Draw the panel of one frequency. trials: at least one. The grey line is the median ratio of acceleration along
    the direction to level, times the level."""
    style_axes(axes)
    is_rasterized = len(trials) > _MOST_VECTOR_POINTS
    levels_n = np.array([trial.level_n for trial in trials])
    on_axis_mps2 = np.array([trial.delivered_mps2 for trial in trials], dtype=np.float64)
    # A logarithmic axis cannot show 0: like a missing value it becomes NaN and is not drawn.
    off_axis_mps2 = np.array([trial.off_axis_mps2 or np.nan for trial in trials], dtype=np.float64)
    axes.loglog(levels_n, on_axis_mps2, "o", color=BLUE, markersize=3, alpha=0.5, rasterized=is_rasterized)
    axes.loglog(levels_n, off_axis_mps2, "s", color=VERMILLION, markersize=3, alpha=0.5, rasterized=is_rasterized,
                markerfacecolor="none")  # fmt: skip
    level_range_n = np.array([levels_n.min(), levels_n.max()])
    axes.loglog(level_range_n, level_range_n * np.median(on_axis_mps2 / levels_n), color=GREY, linewidth=1)


def _make_legend_handles() -> list[Line2D]:
    """Make the handles of the legend: acceleration along and off the direction, and the line of proportionality."""
    return [
        Line2D([], [], marker="o", color=BLUE, linewidth=0, label="along the direction"),
        Line2D([], [], marker="s", color=VERMILLION, markerfacecolor="none", linewidth=0, label="off the direction"),
        Line2D([], [], color=GREY, linewidth=1, label="proportional (median)"),
    ]
