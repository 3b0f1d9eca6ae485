"""Figures of psychometric functions: observed shares of right answers over level, and the fitted curves.

Shares come in bins of levels with Wilson's 95 % interval (`hierarchy.observed_shares`); the curves are those of the
hierarchical model, or of each person alone. One panel per frequency; one figure for all people together, one per
person.
"""

import math
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from analysis.figures.style import (
    BLACK,
    BLUE,
    GREY,
    create_figure,
    create_panel_grid,
    draw_no_data_note,
    label_panel_axes,
    set_newton_ticks,
    style_axes,
)
from analysis.psychophysics.hierarchy.answers import Answers
from analysis.psychophysics.hierarchy.curve import TARGET_PROPORTION
from analysis.psychophysics.hierarchy.observed_shares import (
    FittedCurves,
    ObservedShare,
    average_person_curves,
    compute_group_shares,
    compute_person_shares,
    evaluate_person_curve,
)
from analysis.wording import format_newtons
from protocols.procedure.staircase import to_db

_ROW_HEIGHT_IN = 2.2
"""Height of a row of panels, inches. The numbers of this module are chosen by hand."""
_SMALLEST_MARKER, _LARGEST_MARKER = 2.5, 7.5
"""Marker sizes in points: the lower limit, for very few trials, and that of `_LARGEST_MARKER_TRIALS` trials or more."""
_LARGEST_MARKER_TRIALS = 100
"""Number of trials from which a marker has its largest size."""


def draw_people_curves(answers: Answers, fit: FittedCurves) -> Figure:
    """Draw all people together, one panel per frequency, over the level in dB re each person's threshold. answers: of
    at least one trial."""
    frequency_count = len(fit.frequencies_hz)
    figure, panels = create_panel_grid(frequency_count, _ROW_HEIGHT_IN, sharex=True)
    shares_by_frequency = [compute_group_shares(answers, fit, index) for index in range(frequency_count)]
    levels_db = [share.level_db for shares in shares_by_frequency for share in shares]
    level_re_threshold_db = np.linspace(min(levels_db) - 1.0, max(levels_db) + 1.0, 200)
    for index, (axes, shares) in enumerate(zip(panels, shares_by_frequency, strict=False)):
        _draw_shares(axes, [share.level_db for share in shares], shares)
        axes.plot(
            level_re_threshold_db,
            100 * average_person_curves(level_re_threshold_db, answers, fit, index),
            color=BLACK,
            linewidth=1.4,
            zorder=2,
        )
        axes.axvline(0.0, color=GREY, linestyle=":", linewidth=1.0)
        axes.set_title(f"{fit.frequencies_hz[index]:g} Hz", fontsize=10, loc="left")
    label_panel_axes(panels, frequency_count, "Level re threshold (dB)", "Right (%)")
    panels[-1].legend(
        handles=_make_legend_handles("curve of the model,\nmean of the people"),
        loc="center",
        fontsize=8.5,
        frameon=False,
    )
    return figure


def draw_person_curves(answers: Answers, fit: FittedCurves, person: int, cap_n: float) -> Figure:
    """Draw one person, one panel per frequency with answers, over the level in newtons; the figure contains a note
    where there are no answers. person: index in `answers`. cap_n: cap of the level, a dashed line."""
    estimate, frequency_count = fit.persons[person], len(fit.frequencies_hz)
    answered_frequencies = [
        (index, shares) for index in range(frequency_count) if (shares := compute_person_shares(answers, person, index))
    ]
    if not answered_frequencies:
        return draw_no_data_note(create_figure(4.0, 2.0), "There is no answer to draw.")
    figure, panels = create_panel_grid(len(answered_frequencies), _ROW_HEIGHT_IN)
    for axes, (index, shares) in zip(panels, answered_frequencies, strict=False):
        levels_n = [10.0 ** (share.level_db / 20.0) for share in shares]
        low_n, high_n = 0.8 * min(levels_n), 1.15 * max(*levels_n, cap_n)
        curve_levels_n = np.geomspace(low_n, high_n, 200)
        level_re_threshold_db = 20.0 * np.log10(curve_levels_n) - to_db(estimate.thresholds_n[index])
        _draw_shares(axes, levels_n, shares)
        axes.plot(
            curve_levels_n,
            100 * evaluate_person_curve(level_re_threshold_db, estimate, fit),
            color=BLACK,
            linewidth=1.4,
            zorder=2,
        )
        axes.axvline(cap_n, color=GREY, linestyle="--", linewidth=1.0)
        if not estimate.above_cap[index]:
            axes.axvline(estimate.thresholds_n[index], color=GREY, linestyle=":", linewidth=1.0)
        axes.set_xscale("log")
        set_newton_ticks(axes.xaxis, low_n, high_n)
        axes.set_xlim(low_n, high_n)
        threshold_text = (
            "above the cap" if estimate.above_cap[index] else f"{format_newtons(estimate.thresholds_n[index])} N"
        )
        axes.set_title(f"{fit.frequencies_hz[index]:g} Hz: {threshold_text}", fontsize=10, loc="left")
    label_panel_axes(panels, len(answered_frequencies), "Level (N)", "Right (%)")
    cap_handle = Line2D([], [], color=GREY, linestyle="--", linewidth=1, label=f"cap {cap_n:g} N")
    panels[-1].legend(
        handles=[*_make_legend_handles("curve of the model"), cap_handle], loc="center", fontsize=8.5, frameon=False
    )
    return figure


def _draw_shares(axes: Axes, levels: Sequence[float], shares: Sequence[ObservedShare]) -> None:
    """Draw shares in percent at these levels (N or dB), with their intervals and a dotted line at
    `TARGET_PROPORTION`, the share at the threshold."""
    style_axes(axes)
    axes.axhline(100 * TARGET_PROPORTION, color=GREY, linestyle=":", linewidth=1.0)
    for level, share in zip(levels, shares, strict=True):
        axes.plot([level, level], [100 * share.lower, 100 * share.upper], color=BLUE, linewidth=0.8, zorder=1)
        axes.plot(level, 100 * share.share, "o", color=BLUE, markersize=_compute_marker_size(share.trials), zorder=3,
                  markeredgecolor="white", markeredgewidth=0.4)  # fmt: skip
    axes.set_ylim(0, 104)
    axes.set_yticks([0, 25, 50, 75, 100])


def _compute_marker_size(trial_count: int) -> float:
    """Compute the marker size in points: it rises with the square root of the trials up to `_LARGEST_MARKER_TRIALS`."""
    return _SMALLEST_MARKER + (_LARGEST_MARKER - _SMALLEST_MARKER) * math.sqrt(
        min(1.0, trial_count / _LARGEST_MARKER_TRIALS)
    )


def _make_legend_handles(curve_label: str) -> list[Line2D]:
    """Make the handles of the legend. curve_label: text for the fitted curve."""
    return [
        *(
            Line2D(
                [], [], marker="o", color=BLUE, linewidth=0.8, markersize=_compute_marker_size(trial_count), label=label
            )
            for trial_count, label in (
                (5, "5 trials, 95 % interval"),
                (_LARGEST_MARKER_TRIALS, f"{_LARGEST_MARKER_TRIALS} trials or more"),
            )
        ),
        Line2D([], [], color=BLACK, linewidth=1.4, label=curve_label),
        Line2D(
            [], [], color=GREY, linestyle=":", linewidth=1.0, label=f"threshold, {100 * TARGET_PROPORTION:.1f} % right"
        ),
    ]
