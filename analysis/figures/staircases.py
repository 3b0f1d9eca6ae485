"""Figure of a participant's staircases: one panel per run, the level (N, logarithmic) over the number of the trial.

Dots and crosses are right and wrong answers, rings are reversals. The threshold is the mean of the levels at the last
reversals (black rings), or, for the Psi method, the mean of the posterior. A dashed line is the cap, the highest level
allowed.
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
    PAGE_WIDTH_IN,
    VERMILLION,
    create_figure,
    create_panel_grid,
    draw_no_data_note,
    label_panel_axes,
    set_newton_ticks,
    style_axes,
)
from analysis.psychophysics.runs import Run
from analysis.psychophysics.thresholds import RunEnd, Threshold, compute_run_threshold
from analysis.wording import format_newtons
from protocols.definition.staircase_rule import StaircaseRule

_PANEL_ROW_HEIGHT_IN = 2.2
"""Height of a row of panels, in inches. Chosen by hand."""


def draw_staircases(runs: Sequence[Run], rule: StaircaseRule) -> Figure:
    """Draw one panel per run, ordered by frequency, session and run; the figure contains a note where there is no run.
    runs: of a single participant; of several sessions, each panel's title names its session. rule: their staircase
    rule."""
    if not runs:
        return draw_no_data_note(create_figure(PAGE_WIDTH_IN, 2.0), "There is no run to draw.")
    axis_minimum_n = 0.75 * min([trial.staircase_n for run in runs for trial in run.answered], default=rule.start_n)
    ordered_runs = sorted(runs, key=lambda run: (run.frequency_hz, run.session, run.run))
    figure, panels = create_panel_grid(len(ordered_runs), _PANEL_ROW_HEIGHT_IN)
    # A participant who came twice has two panels of one frequency.
    has_several_sessions = len({run.session for run in runs}) > 1
    for panel, run in zip(panels, ordered_runs, strict=False):
        _draw_staircase(panel, run, rule, f"Session {run.session}\n" if has_several_sessions else "")
        panel.set_ylim(axis_minimum_n, 1.25 * rule.cap_n)
        set_newton_ticks(panel.yaxis, axis_minimum_n, rule.cap_n)
    label_panel_axes(panels, len(ordered_runs), "Trial", "Level (N)")
    panels[-1].legend(handles=_make_legend_handles(rule), loc="center", fontsize=8.5, frameon=False)
    return figure


def _draw_staircase(axes: Axes, run: Run, rule: StaircaseRule, session_line: str) -> None:
    """Draw the levels, answers, reversals and threshold of a run; without a threshold where the run is not complete.
    session_line: first line of the title, or empty. The title has 9 points: at 10, the longest outcome would reach into
    the next panel."""
    style_axes(axes)
    levels_n = np.array([trial.staircase_n for trial in run.answered])
    trial_numbers = np.arange(1, len(levels_n) + 1)
    is_correct = np.array([bool(trial.correct) for trial in run.answered], dtype=bool)
    reversal_indices = np.array(run.state.reversal_trials, dtype=int)
    averaged_indices = reversal_indices[-rule.averaged_reversals :] if run.complete else reversal_indices[:0]
    axes.axhline(rule.cap_n, color=GREY, linestyle="--", linewidth=1)
    axes.plot(trial_numbers, levels_n, color=GREY, linewidth=0.9, drawstyle="steps-post", zorder=1)
    axes.plot(trial_numbers[is_correct], levels_n[is_correct], "o", color=BLUE, markersize=2.8)
    axes.plot(
        trial_numbers[~is_correct], levels_n[~is_correct], "x", color=VERMILLION, markersize=4.5, markeredgewidth=1.3
    )
    axes.plot(
        trial_numbers[reversal_indices],
        levels_n[reversal_indices],
        "o",
        markersize=8,
        markerfacecolor="none",
        markeredgecolor=GREY,
    )
    axes.plot(
        trial_numbers[averaged_indices],
        levels_n[averaged_indices],
        "o",
        markersize=8,
        markerfacecolor="none",
        markeredgecolor=BLACK,
    )
    threshold = compute_run_threshold(run, rule)
    if threshold.threshold_n is not None:
        axes.plot(
            [trial_numbers[averaged_indices[0]] if len(averaged_indices) else 1, trial_numbers[-1]],
            [threshold.threshold_n] * 2,
            color=BLACK,
            linewidth=1.1,
            zorder=3,
        )
    axes.set_yscale("log")
    axes.set_title(f"{session_line}{run.frequency_hz:g} Hz{_describe_outcome(threshold)}", fontsize=9, loc="left")


def _describe_outcome(threshold: Threshold) -> str:
    """Describe how a run ended, at the end of its panel's title: the threshold in N, or why there is none."""
    if threshold.threshold_n is not None:
        return f": {format_newtons(threshold.threshold_n)} N{', cut by the cap' if threshold.censored else ''}"
    return " (stopped by the trial limit)" if threshold.ended is RunEnd.TRIAL_LIMIT else " (not complete)"


def _make_legend_handles(rule: StaircaseRule) -> list[Line2D]:
    """Make the entries of the legend; without reversals where the Psi method chose the levels."""
    return [
        Line2D([], [], marker="o", color=BLUE, markersize=4, linewidth=0, label="right"),
        Line2D([], [], marker="x", color=VERMILLION, linewidth=0, label="wrong"),
        *([] if rule.is_bayesian else _make_reversal_handles(rule)),
        Line2D([], [], color=BLACK, linewidth=1.1, label="threshold"),
        Line2D([], [], color=GREY, linestyle="--", linewidth=1, label=f"cap {rule.cap_n:g} N"),
    ]


def _make_reversal_handles(rule: StaircaseRule) -> list[Line2D]:
    """Make the legend entries of averaged and other reversals."""
    return [
        _make_circle_handle(BLACK, f"reversal, one of the last {rule.averaged_reversals}"),
        _make_circle_handle(GREY, "reversal, not averaged"),
    ]


def _make_circle_handle(colour: str, label: str) -> Line2D:
    """Make a legend entry: an open circle of this colour with its label."""
    return Line2D(
        [], [], marker="o", markersize=8, markerfacecolor="none", markeredgecolor=colour, linewidth=0, label=label
    )
