"""Common style of all figures: colours that colour-blind readers can distinguish, and redundant markers.

Palette: M. Okabe, K. Ito, Color Universal Design (2008).
"""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure

BLUE, ORANGE, GREEN, VERMILLION = "#0072B2", "#E69F00", "#009E73", "#D55E00"
PURPLE, SKY, BLACK, GREY = "#CC79A7", "#56B4E9", "#000000", "#6B6B6B"
WINE, OLIVE, TEAL = "#882255", "#999933", "#117766"
COLOURS = (BLUE, ORANGE, GREEN, VERMILLION, PURPLE, SKY, BLACK, WINE, OLIVE, TEAL)
"""Ten, for the ten participants of the published study; the last three after P. Tol's muted scheme."""
MARKERS = ("o", "s", "D", "P", "X", "p", "h", "d", "*", "8")
CUT_MARKER = "$\\uparrow$"
"""An arrow above the participant's own marker: the cap cut into this threshold."""
_STEPS = ((1.5, (1.0, 1.5, 2.0, 3.0, 5.0, 7.0)), (3.0, (1.0, 2.0, 5.0)), (4.0, (1.0, 3.0)), (np.inf, (1.0,)))
"""Tick multiples by the number of decades of an axis."""

_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def new_figure(width_in: float, height_in: float) -> Figure:
    return Figure(figsize=(width_in, height_in), facecolor="white", layout="constrained")


def plain_axes(axes: Axes) -> None:
    """A light grid behind the data and no box around it."""
    axes.set_axisbelow(True)
    axes.grid(True, color="#DDDDDD", linewidth=0.6)
    axes.tick_params(labelsize=9)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)


def newton_ticks(axis: Axis, lowest_n: float, highest_n: float) -> None:
    """Round levels on a logarithmic axis, written as people say them. Call after the scale is set."""
    levels = [level for level in (0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 3.0) if lowest_n <= level <= highest_n]
    axis.set_ticks(levels, labels=[f"{level:g}" for level in levels])
    axis.set_ticks([], minor=True)


def ratio_ticks(axis: Axis, low: float, high: float) -> None:
    """Round multiples on a logarithmic axis, as many as there is room for. Call after the scale is set."""
    decades = np.log10(high / low)
    steps = next(each for most, each in _STEPS if decades <= most)
    powers = range(int(np.floor(np.log10(low))), int(np.ceil(np.log10(high))) + 1)
    values = [step * 10.0**power for power in powers for step in steps]
    shown = [value for value in values if low <= value <= high]
    axis.set_ticks(shown, labels=[f"{value:.10g}" for value in shown])
    axis.set_ticks([], minor=True)


def power_of_ten(value: float) -> str:
    """0.001 as "10⁻³": written out, because formulas take matplotlib a second."""
    return "10" + f"{np.log10(value):.0f}".translate(_RAISED) if value > 0 else ""


def say_nothing_to_draw(figure: Figure, sentence: str) -> Figure:
    figure.text(0.5, 0.5, sentence, ha="center", va="center", fontsize=11, color=GREY)
    return figure
