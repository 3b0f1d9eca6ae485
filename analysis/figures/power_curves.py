"""Figure of statistical power over the number of participants, by analysis, and of the coverage of the intervals.

The upper panel shows the share of simulated studies in which each analysis finds the difference: the power, or without
a true difference the type-1 error. The lower panel shows the coverage of the primary analysis's 95 % interval. Both
come from `analysis.psychophysics.power.power_curve`.
"""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.container import ErrorbarContainer
from matplotlib.figure import Figure

from analysis.figures.picture import Picture
from analysis.figures.style import BLUE, GREY, ORANGE, PAGE_WIDTH_IN, VERMILLION, create_figure, style_axes
from analysis.psychophysics.power.power_curve import CONFIDENCE, PowerPoint, Share
from analysis.threshold_words import REVERSAL_WORDS
from equalizer.signals.signal import FloatArray

_TARGET_POWER_PERCENT = 80.0
"""Conventional target of the power, percent (J. Cohen, Statistical Power Analysis for the Behavioral Sciences,
1988)."""
_MARKER_OFFSET_PEOPLE = 0.12
"""Horizontal offset between the curves, in participants, so that their error bars do not hide each other. Chosen by
eye."""
_MARGIN_PEOPLE = 1.5
"""Margin at either end of the horizontal axis, in participants. Chosen by eye."""


def make_power_picture(
    points: Sequence[PowerPoint],
    effect_db: float,
    pair_hz: tuple[float, float],
    threshold_noun: str = REVERSAL_WORDS.noun,
) -> Picture:
    """Make the picture of power and coverage with its caption. points: at least one, each of one sample size.
    effect_db: true threshold at the first frequency of pair_hz minus that at the second; 0: the power is the type-1
    error. threshold_noun: noun for the thresholds of runs, in the plural."""
    outcome_text = "finds the difference" if effect_db else "finds a difference that does not exist (type-1 error)"
    reference_text = "the usual target of the power" if effect_db else "the level of the test"
    return Picture(
        name="power",
        title=f"Of {points[0].studies} simulated studies of each size, with a difference of {effect_db:g} dB "
        f"between {pair_hz[0]:g} and {pair_hz[1]:g} Hz",
        caption=f"Above: share of the studies in which each analysis {outcome_text}. Below: share in which the primary "
        f"analysis's {100 * CONFIDENCE:g} % interval holds the true difference. Bars: 95 % intervals of the shares. "
        f"Grey lines: {_choose_reference_percent(effect_db):g} %, {reference_text}, and {100 * CONFIDENCE:g} %.",
        figure=_draw_power(points, effect_db, threshold_noun),
        alternative="; ".join(
            f"{point.people} participants: found in {100 * point.primary.value:.0f} % by all answers in one model, in "
            f"{100 * point.means.value:.0f} % by {threshold_noun}"
            for point in points
        ),
    )


def _choose_reference_percent(effect_db: float) -> float:
    """Choose the reference line, percent: the conventional power, or without an effect the level of the test."""
    return _TARGET_POWER_PERCENT if effect_db else 100 * (1 - CONFIDENCE)


def _draw_power(points: Sequence[PowerPoint], effect_db: float, threshold_noun: str) -> Figure:
    """Draw two panels: power (above) and coverage (below) over the number of participants."""
    figure = create_figure(PAGE_WIDTH_IN, 5.6)
    power_axes, coverage_axes = figure.subplots(2, 1, sharex=True, height_ratios=(2, 1))
    curves = (
        ("all answers in one model", BLUE, "o-", [point.primary for point in points]),
        (f"{threshold_noun}, paired", ORANGE, "s--", [point.means for point in points]),
        ("as published (Tukey)", VERMILLION, "D:", [point.published for point in points]),
    )
    people = np.array([point.people for point in points], dtype=float)
    for index, (label, colour, format_string, shares) in enumerate(curves):
        error_bars = _draw_shares(
            power_axes, people + _MARKER_OFFSET_PEOPLE * (index - 1), shares, colour, format_string
        )
        error_bars.set_label(label)
    _draw_shares(coverage_axes, people, [point.coverage for point in points], BLUE, "o-")
    power_axes.axhline(_choose_reference_percent(effect_db), color=GREY, linewidth=0.9)
    coverage_axes.axhline(100 * CONFIDENCE, color=GREY, linewidth=0.9)
    power_axes.set_ylim(0, 103 if effect_db else None)
    power_axes.set_ylabel("Found (% of studies)", fontsize=9)
    coverage_axes.set_ylabel("Covered (%)", fontsize=9)
    coverage_axes.set_xlabel("Participants", fontsize=9)
    coverage_axes.set_xticks(people)
    # A fixed margin, so that the markers of one sample size stay close together where there are few sizes.
    coverage_axes.set_xlim(people.min() - _MARGIN_PEOPLE, people.max() + _MARGIN_PEOPLE)
    for axes in (power_axes, coverage_axes):
        style_axes(axes)
    figure.legend(
        *power_axes.get_legend_handles_labels(), loc="outside upper right", ncols=3, fontsize=8, frameon=False
    )
    return figure


def _draw_shares(
    axes: Axes, people: FloatArray, shares: Sequence[Share], colour: str, format_string: str
) -> ErrorbarContainer:
    """Draw shares, 0 to 1, in percent, with their intervals as error bars. people: (points,), number of participants.
    format_string: marker and line in matplotlib's notation."""
    percentages = 100 * np.array([(share.value, share.lower, share.upper) for share in shares])
    bar_lengths = np.abs(percentages[:, 1:] - percentages[:, :1]).T
    return axes.errorbar(
        people,
        percentages[:, 0],
        bar_lengths,
        fmt=format_string,
        color=colour,
        markersize=5,
        linewidth=1.4,
        elinewidth=0.9,
        capsize=2,
    )
