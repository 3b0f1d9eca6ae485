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
"""Largest number of decades of an axis, and the multiples of powers of ten that are its ticks. By hand."""

_SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")

PAGE_IN = 7.2
"""Width of a figure over both columns of a paper (183 mm); text of 8 to 10 points needs no scaling there."""


def new_figure(width_in: float, height_in: float) -> Figure:
    """An empty white figure whose layout fits itself; sizes in inches."""
    return Figure(figsize=(width_in, height_in), facecolor="white", layout="constrained")


def plain_axes(axes: Axes) -> None:
    """A light grid behind the data and no box around it."""
    axes.set_axisbelow(True)
    axes.grid(True, color="#DDDDDD", linewidth=0.6)
    axes.tick_params(labelsize=9)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)


def participant_colour(number: int) -> str:
    """Colour of a participant by number from 0; colours recur after the last of `COLOURS`."""
    return COLOURS[number % len(COLOURS)]


def participant_marker(number: int) -> str:
    """Marker of a participant by number from 0, so that participants differ in a grey print, too."""
    return MARKERS[number % len(MARKERS)]


def panel_grid(panels: int, height_in: float, sharex: bool = False) -> tuple[Figure, list[Axes]]:
    """A page-wide figure of up to three columns, and its axes row by row: at least one more than there are panels, for
    the legend; axes without a panel are switched off. height_in: height of a row of panels (inches)."""
    columns = min(3, panels + 1)
    rows = -(-(panels + 1) // columns)
    figure = new_figure(PAGE_IN, height_in * rows)
    grid = figure.subplots(rows, columns, sharex=sharex, sharey=True, squeeze=False)
    panel_axes = [axes for grid_row in grid for axes in grid_row]
    for axes in panel_axes[panels:]:
        axes.axis("off")
    return figure, panel_axes


def name_panel_axes(panel_axes: list[Axes], panels: int, x_label: str, y_label: str) -> None:
    """Labels below the lowest panel of each column and left of each line of `panel_grid`."""
    columns = min(3, panels + 1)
    for number in range(0, panels, columns):
        panel_axes[number].set_ylabel(y_label)
    for number in range(max(0, panels - columns), panels):
        panel_axes[number].set_xlabel(x_label)
        panel_axes[number].tick_params(labelbottom=True)


def newton_ticks(axis: Axis, lowest_n: float, highest_n: float) -> None:
    """Ticks at 1, 2 and 5 times powers of ten (N) on a logarithmic axis, as decimals. Call after the scale is set."""
    levels = [level for level in (0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 3.0) if lowest_n <= level <= highest_n]
    axis.set_ticks(levels, labels=[f"{level:g}" for level in levels])
    axis.set_ticks([], minor=True)


def ratio_ticks(axis: Axis, low: float, high: float) -> None:
    """Ticks from low to high on a logarithmic axis, at the multiples of powers of ten of `_STEPS`: fewer of them the
    more decades there are. Call after the scale is set."""
    decades = np.log10(high / low)
    steps = next(multiples for most_decades, multiples in _STEPS if decades <= most_decades)
    powers = range(int(np.floor(np.log10(low))), int(np.ceil(np.log10(high))) + 1)
    values = [step * 10.0**power for power in powers for step in steps]
    tick_values = [value for value in values if low <= value <= high]
    axis.set_ticks(tick_values, labels=[f"{value:.10g}" for value in tick_values])
    axis.set_ticks([], minor=True)


def power_of_ten(value: float) -> str:
    """A power of ten as text, such as "10⁻³" for 0.001; other values are rounded to one, and 0 or less is empty.
    Without matplotlib's own formulas, whose first use takes a second."""
    return "10" + f"{np.log10(value):.0f}".translate(_SUPERSCRIPTS) if value > 0 else ""


def draw_no_data_note(figure: Figure, sentence: str) -> Figure:
    """The figure with a sentence in its middle in place of a plot."""
    figure.text(0.5, 0.5, sentence, ha="center", va="center", fontsize=11, color=GREY)
    return figure
