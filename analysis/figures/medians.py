"""Draw the figure of the primary analysis of a study: median thresholds by frequency with intervals, the participants'
estimates, and the limit of direction perception.

The values come from a hierarchical psychometric model (`analysis.psychophysics.hierarchy`). Thresholds are force
amplitudes in N. Above the cap, the largest force of the staircase, at most a lower bound is known. The constants below
set the layout; chosen by eye.
"""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from analysis.figures.style import (
    BLACK,
    CENSORED_MARKER,
    GREY,
    PAGE_WIDTH_IN,
    choose_colour,
    choose_height_in,
    create_axes,
    make_participant_handles,
    set_ratio_ticks,
)
from analysis.figures.thresholds import draw_threshold
from analysis.psychophysics.hierarchy.inference import DirectionLimit, MedianThreshold
from analysis.psychophysics.hierarchy.primary import PersonEstimate, PrimaryAnalysis

_PARTICIPANT_SPREAD = 0.5
"""Width over which the participants are spread at one frequency, as a share of the step between frequencies."""
_ABOVE_CAP_RATIO, _SMALLEST_TOP_RATIO = 1.12, 1.45
"""Ordinate at which participants' thresholds above the cap are drawn, and smallest upper end of the axis, relative to
the cap."""
_LARGEST_TOP_RATIO, _LEAST_ARROW_RATIO = 8.0, 1.25
"""Largest upper end of the axis, relative to the cap; and smallest ratio of an arrow's upper to its lower end."""


def draw_medians(primary: PrimaryAnalysis, cap_n: float) -> Figure:
    """Draw thresholds in N on a logarithmic axis, by frequency.

    A threshold above the cap has no known size: participants are drawn on a common line with an arrow, and a median as
    an arrow that begins at its one-sided lower bound (below it near the end of the axis), without one at the lower end
    of the axis. cap_n: largest force of the staircase, N."""
    legend_handles = _make_legend_handles(primary, cap_n)
    figure, axes = create_axes(PAGE_WIDTH_IN, choose_height_in(legend_handles, 4.2))
    axes.set_yscale("log")
    top_n, bottom_n = _compute_upper_limit_n(primary, cap_n), _compute_lower_limit_n(primary, cap_n)
    axes.set_ylim(bottom_n, top_n)
    set_ratio_ticks(axes.yaxis, bottom_n, cap_n)
    axes.axhline(cap_n, color=GREY, linestyle="--", linewidth=1.2)
    shifts = np.linspace(-_PARTICIPANT_SPREAD / 2, _PARTICIPANT_SPREAD / 2, len(primary.persons))
    answered = {(run.subject, run.frequency_hz) for run in primary.runs}
    for participant, person in enumerate(primary.persons):
        has_answers = np.array([(person.subject, frequency_hz) in answered for frequency_hz in primary.frequencies_hz])
        _draw_person(axes, person, (participant, shifts[participant]), has_answers, cap_n)
    for index, median in enumerate(primary.medians):
        _draw_median(axes, index, median, (bottom_n, top_n))
    _draw_direction_limit(axes, primary.limit, primary.frequencies_hz, cap_n)
    axes.set_xticks(range(len(primary.frequencies_hz)), [f"{tick_hz:g}" for tick_hz in primary.frequencies_hz])
    axes.set_xlim(-0.6, len(primary.frequencies_hz) - 0.4)
    axes.set_xlabel("Frequency (Hz)")
    axes.set_ylabel("Threshold (N)")
    figure.legend(handles=legend_handles, loc="outside right upper", fontsize=8.5, frameon=False)
    return figure


def _compute_upper_limit_n(primary: PrimaryAnalysis, cap_n: float) -> float:
    """Compute the upper end of the axis in N: above the known bounds of all medians, but at most `_LARGEST_TOP_RATIO`
    times the cap, so that the rest stays readable."""
    upper_ends_n = [median.upper_n or _LEAST_ARROW_RATIO * (median.lower_n or 0.0) for median in primary.medians]
    return min(
        max(_SMALLEST_TOP_RATIO * cap_n, *(1.1 * upper_end_n for upper_end_n in upper_ends_n)),
        _LARGEST_TOP_RATIO * cap_n,
    )


def _compute_lower_limit_n(primary: PrimaryAnalysis, cap_n: float) -> float:
    """Compute the lower end of the axis in N: 15 % below the cap, all thresholds and all lower bounds, so that the cap
    is shown also where all thresholds lie above it."""
    thresholds_n = [threshold_n for person in primary.persons for threshold_n in person.thresholds_n]
    return 0.85 * min(cap_n, *thresholds_n, *(median.lower_n or median.newton for median in primary.medians))


def _draw_person(
    axes: Axes,
    person: PersonEstimate,
    index_and_shift: tuple[int, float],
    has_answers: NDArray[np.bool_],
    cap_n: float,
) -> None:
    """Draw a participant's thresholds, joined by a line. index_and_shift: index of the participant, which determines
    marker and colour, and shift along the abscissa. has_answers: (k,), frequencies at which the participant has
    answers; the model's estimates elsewhere are not drawn."""
    participant, shift = index_and_shift
    above_cap = np.array(person.above_cap)
    ordinates_n = np.where(above_cap, _ABOVE_CAP_RATIO * cap_n, person.thresholds_n)[has_answers]
    abscissae = (np.arange(len(has_answers)) + shift)[has_answers]
    axes.plot(abscissae, ordinates_n, "-", color=choose_colour(participant), linewidth=0.7, alpha=0.45, zorder=1)
    for abscissa, ordinate_n, is_above in zip(abscissae, ordinates_n, above_cap[has_answers], strict=True):
        draw_threshold(axes, float(abscissa), float(ordinate_n), participant, bool(is_above))


def _draw_median(axes: Axes, index: int, median: MedianThreshold, axis_ends_n: tuple[float, float]) -> None:
    """Draw the median at one frequency with its interval, or an arrow where it is above the cap. axis_ends_n: lower and
    upper end of the ordinate, N."""
    if median.above_cap:
        arrow_start_n = (
            axis_ends_n[0] if median.lower_n is None else min(median.lower_n, axis_ends_n[1] / _LEAST_ARROW_RATIO)
        )
        axes.annotate("", (index, axis_ends_n[1]), xytext=(index, arrow_start_n), zorder=4,
                      arrowprops={"arrowstyle": "-|>", "color": BLACK, "linewidth": 1.6, "shrinkA": 0,
                                  "shrinkB": 0})  # fmt: skip
        if median.lower_n is not None:
            axes.plot(index, arrow_start_n, "_", color=BLACK, markersize=9, markeredgewidth=1.6, zorder=4)
        return
    axes.plot(index, median.newton, "_", color=BLACK, markersize=22, markeredgewidth=2.4, zorder=4)
    if median.lower_n is not None and median.upper_n is not None:
        bar_lengths_n = [[median.newton - median.lower_n], [median.upper_n - median.newton]]
        axes.errorbar(
            index, median.newton, yerr=bar_lengths_n, fmt="none", color=BLACK, elinewidth=1.6, capsize=4, zorder=4
        )


def _draw_direction_limit(axes: Axes, limit: DirectionLimit, frequencies_hz: tuple[float, ...], cap_n: float) -> None:
    """Draw the limit of direction perception (the frequency at which the median reaches the cap) with its interval, on
    the line of the cap; nothing without a limit. A bound that is None is drawn at the outermost frequency. The abscissa
    is interpolated in log frequency."""
    if limit.frequency_hz is None:
        return
    limit_and_ends_hz = (limit.lower_hz or frequencies_hz[0], limit.frequency_hz, limit.upper_hz or frequencies_hz[-1])
    low_x, limit_x, high_x = np.interp(
        np.log(limit_and_ends_hz), np.log(frequencies_hz), np.arange(len(frequencies_hz))
    )
    axes.plot(
        [low_x, high_x], [cap_n, cap_n], "-", color=BLACK, linewidth=3.2, alpha=0.75, solid_capstyle="butt", zorder=3
    )
    axes.plot(limit_x, cap_n, "D", color="white", markeredgecolor=BLACK, markeredgewidth=1.6, markersize=8, zorder=6)


def _make_legend_handles(primary: PrimaryAnalysis, cap_n: float) -> list[Line2D]:
    """Make the legend entries of the marks that the figure contains, and of the participants if they are not too
    many."""
    confidence_text = f"{100 * primary.confidence:g} %"
    handles = [
        Line2D([], [], color=BLACK, marker="_", markersize=12, markeredgewidth=2.4, linewidth=0,
               label=f"median participant,\n{confidence_text} interval")
    ]  # fmt: skip
    if any(median.above_cap for median in primary.medians):
        handles.append(Line2D([], [], color=BLACK, marker=CENSORED_MARKER, linewidth=0, markersize=10,
                              label=f"median above the cap:\n{confidence_text} lower bound"))  # fmt: skip
    if primary.limit.frequency_hz is not None:
        handles.append(Line2D([], [], color=BLACK, marker="D", markerfacecolor="white", markersize=7, linewidth=3.2,
                              label=f"direction limit,\n{confidence_text} interval"))  # fmt: skip
    handles.append(Line2D([], [], color=GREY, linestyle="--", linewidth=1.2, label=f"cap {cap_n:g} N"))
    return [*handles, *make_participant_handles([person.subject for person in primary.persons])]
