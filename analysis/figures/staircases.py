"""Figure of a participant's staircases: one panel per run, the level (N, logarithmic) over the number of the trial.

Dots and crosses are right and wrong answers, rings are reversals; the threshold averages the levels at the last of
them (black rings), or is the mean of Psi's posterior. A dashed line is the cap, the highest level allowed.
"""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from analysis.figures.style import (
    BLACK,
    BLUE,
    GREY,
    PAGE_IN,
    VERMILLION,
    draw_no_data_note,
    name_panel_axes,
    new_figure,
    newton_ticks,
    panel_grid,
    plain_axes,
)
from analysis.psychophysics.runs import Run
from analysis.psychophysics.thresholds import RunEnd, Threshold, threshold_of
from protocols.definition.staircase_rule import StaircaseRule

_ROW_IN = 2.2
"""Height of a row of panels, in inches."""


def draw_staircases(runs: Sequence[Run], rule: StaircaseRule) -> Figure:
    """One panel per run, ordered by frequency; a note where there is no run. runs: of one participant."""
    if not runs:
        return draw_no_data_note(new_figure(PAGE_IN, 2.0), "There is no run to draw.")
    lowest_n = 0.75 * min([trial.staircase_n for run in runs for trial in run.answered], default=rule.start_n)
    ordered = sorted(runs, key=lambda run: (run.frequency_hz, run.session, run.run))
    figure, panels = panel_grid(len(ordered), _ROW_IN)
    for panel, run in zip(panels, ordered, strict=False):
        _draw_run(panel, run, rule)
        panel.set_ylim(lowest_n, 1.25 * rule.cap_n)
        newton_ticks(panel.yaxis, lowest_n, rule.cap_n)
    name_panel_axes(panels, len(ordered), "Trial", "Level (N)")
    panels[-1].legend(handles=_legend_handles(rule), loc="center", fontsize=8.5, frameon=False)
    return figure


def _draw_run(axes: Axes, run: Run, rule: StaircaseRule) -> None:
    """Draw the levels, answers, reversals and threshold of a run; without a threshold where the run is not complete."""
    plain_axes(axes)
    levels = np.array([trial.staircase_n for trial in run.answered])
    numbers = np.arange(1, len(levels) + 1)
    is_correct = np.array([bool(trial.correct) for trial in run.answered], dtype=bool)
    reversals = np.array(run.state.reversal_trials, dtype=int)
    averaged = reversals[-rule.averaged_reversals :] if run.complete else reversals[:0]
    axes.axhline(rule.cap_n, color=GREY, linestyle="--", linewidth=1)
    axes.plot(numbers, levels, color=GREY, linewidth=0.9, drawstyle="steps-post", zorder=1)
    axes.plot(numbers[is_correct], levels[is_correct], "o", color=BLUE, markersize=2.8)
    axes.plot(numbers[~is_correct], levels[~is_correct], "x", color=VERMILLION, markersize=4.5, markeredgewidth=1.3)
    axes.plot(numbers[reversals], levels[reversals], "o", markersize=8, markerfacecolor="none", markeredgecolor=GREY)
    axes.plot(numbers[averaged], levels[averaged], "o", markersize=8, markerfacecolor="none", markeredgecolor=BLACK)
    row = threshold_of(run, rule)
    if row.threshold_n is not None:
        axes.plot(
            [numbers[averaged[0]] if len(averaged) else 1, numbers[-1]],
            [row.threshold_n] * 2,
            color=BLACK,
            linewidth=1.1,
            zorder=3,
        )
    axes.set_yscale("log")
    axes.set_title(f"{run.frequency_hz:g} Hz{_outcome_text(row)}", fontsize=10, loc="left")


def _outcome_text(row: Threshold) -> str:
    """End of a panel's title: the threshold in N, or why there is none."""
    if row.threshold_n is not None:
        return f": {row.threshold_n:.2f} N{', cut by the cap' if row.censored else ''}"
    return " (stopped by the trial limit)" if row.ended is RunEnd.TRIAL_LIMIT else " (not complete)"


def _legend_handles(rule: StaircaseRule) -> list[Line2D]:
    """Entries of the legend; no reversals where the Psi method chose the levels."""
    return [
        Line2D([], [], marker="o", color=BLUE, markersize=4, linewidth=0, label="right"),
        Line2D([], [], marker="x", color=VERMILLION, linewidth=0, label="wrong"),
        *([] if rule.is_bayesian else _reversal_handles(rule)),
        Line2D([], [], color=BLACK, linewidth=1.1, label="threshold"),
        Line2D([], [], color=GREY, linestyle="--", linewidth=1, label=f"cap {rule.cap_n:g} N"),
    ]


def _reversal_handles(rule: StaircaseRule) -> list[Line2D]:
    """Legend entries of averaged and other reversals."""
    return [
        _circle_handle(BLACK, f"reversal, one of the last {rule.averaged_reversals}"),
        _circle_handle(GREY, "reversal, not averaged"),
    ]


def _circle_handle(colour: str, label: str) -> Line2D:
    """Legend entry: an open circle of this colour."""
    return Line2D(
        [], [], marker="o", markersize=8, markerfacecolor="none", markeredgecolor=colour, linewidth=0, label=label
    )
