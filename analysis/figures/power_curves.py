"""Power of each analysis over the number of participants, and what the primary analysis's interval covers."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.container import ErrorbarContainer
from matplotlib.figure import Figure

from analysis.figures.picture import Picture
from analysis.figures.style import BLUE, GREY, ORANGE, PAGE_IN, VERMILLION, new_figure, plain_axes
from analysis.psychophysics.power.power_curve import CONFIDENCE, PowerPoint, Share
from analysis.threshold_words import REVERSALS
from equalizer.signals.signal import FloatArray

_DESIRED_POWER = 80.0
"""Percent: what is usually asked for (J. Cohen, Statistical Power Analysis for the Behavioral Sciences, 1988)."""
_MARKER_STEP = 0.12
"""Between the curves' markers, in participants, so that their bars do not hide each other."""
_ROOM = 1.5
"""At either end, in participants."""


def power_picture(
    points: Sequence[PowerPoint], effect_db: float, pair_hz: tuple[float, float], means: str = REVERSALS.means
) -> Picture:
    """points: one sample size each, at least one. effect_db: true difference, 0 for none, of the first frequency of
    pair_hz from the second. means: what thresholds of runs are, in the plural."""
    found = "finds the difference" if effect_db else "finds a difference that is not there (type-1 error)"
    aim = "the power that is usually asked for" if effect_db else "the level of the test"
    return Picture(
        name="power",
        title=f"Of {points[0].studies} simulated studies of each size, with a difference of {effect_db:g} dB "
        f"between {pair_hz[0]:g} and {pair_hz[1]:g} Hz",
        caption=f"Above: share of the studies in which each analysis {found}. Below: share in which the primary "
        f"analysis's {100 * CONFIDENCE:g} % interval holds the true difference. Bars: 95 % intervals of the shares. "
        f"Grey lines: {_line_percent(effect_db):g} %, {aim}, and {100 * CONFIDENCE:g} %.",
        figure=_draw(points, effect_db, means),
        alternative="; ".join(
            f"{point.people} participants: found in {100 * point.primary.value:.0f} % by all answers in one model, in "
            f"{100 * point.means.value:.0f} % by {means}"
            for point in points
        ),
    )


def _line_percent(effect_db: float) -> float:
    return _DESIRED_POWER if effect_db else 100 * (1 - CONFIDENCE)


def _draw(points: Sequence[PowerPoint], effect_db: float, means: str) -> Figure:
    figure = new_figure(PAGE_IN, 5.6)
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(2, 1))
    curves = (
        ("all answers in one model", BLUE, "o-", [point.primary for point in points]),
        (f"{means}, paired", ORANGE, "s--", [point.means for point in points]),
        ("as published (Tukey)", VERMILLION, "D:", [point.published for point in points]),
    )
    people = np.array([point.people for point in points], dtype=float)
    for place, (label, colour, style, shares) in enumerate(curves):
        drawn = _draw_shares(above, people + _MARKER_STEP * (place - 1), shares, colour, style)
        drawn.set_label(label)
    _draw_shares(below, people, [point.coverage for point in points], BLUE, "o-")
    above.axhline(_line_percent(effect_db), color=GREY, linewidth=0.9)
    below.axhline(100 * CONFIDENCE, color=GREY, linewidth=0.9)
    above.set_ylim(0, 103 if effect_db else None)
    above.set_ylabel("Found (% of studies)", fontsize=9)
    below.set_ylabel("Covered (%)", fontsize=9)
    below.set_xlabel("Participants", fontsize=9)
    below.set_xticks(people)
    # With a single size, or close ones, the markers of one size stay beside each other.
    below.set_xlim(people.min() - _ROOM, people.max() + _ROOM)
    for axes in (above, below):
        plain_axes(axes)
    figure.legend(*above.get_legend_handles_labels(), loc="outside upper right", ncols=3, fontsize=8, frameon=False)
    return figure


def _draw_shares(axes: Axes, people: FloatArray, shares: Sequence[Share], colour: str, style: str) -> ErrorbarContainer:
    percent = 100 * np.array([(share.value, share.lower, share.upper) for share in shares])
    bars = np.abs(percent[:, 1:] - percent[:, :1]).T
    return axes.errorbar(
        people, percent[:, 0], bars, fmt=style, color=colour, markersize=5, linewidth=1.4, elinewidth=0.9, capsize=2
    )
