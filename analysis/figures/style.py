"""Common style of the figures: a palette for colour-blind readers, markers, ticks, panel grids and sizes.

Palette: M. Okabe, K. Ito, Color Universal Design (2008).
"""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

BLUE, ORANGE, GREEN, VERMILLION = "#0072B2", "#E69F00", "#009E73", "#D55E00"
PURPLE, SKY, BLACK, GREY = "#CC79A7", "#56B4E9", "#000000", "#6B6B6B"
WINE, OLIVE, TEAL = "#882255", "#999933", "#117766"
"""Colours as RGB hex; their sources are in the module docstring and at `COLOURS`."""
COLOURS = (BLUE, ORANGE, GREEN, VERMILLION, PURPLE, SKY, BLACK, WINE, OLIVE, TEAL)
"""Ten colours, for the ten participants of the published study; the last three after P. Tol's muted scheme."""
MARKERS = ("o", "s", "D", "P", "X", "p", "h", "d", "*", "8")
"""Markers, as many as colours, so that participants can be distinguished without colour."""
CENSORED_MARKER = "$\\uparrow$"
"""Marker in legends for a threshold that the cap (largest level) limited: an arrow upwards."""
_TICK_MULTIPLES = ((1.5, (1.0, 1.5, 2.0, 3.0, 5.0, 7.0)), (3.0, (1.0, 2.0, 5.0)), (4.0, (1.0, 3.0)), (np.inf, (1.0,)))
"""Largest number of decades of an axis, and the multiples of powers of ten that are its ticks. Chosen by hand."""
_LARGEST_LEGEND = 24
"""Largest number of participants for which a legend lists each; with more it lists none. Chosen."""
_SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
"""Raised characters for exponents."""

PAGE_WIDTH_IN = 7.2
"""Width of a figure over both columns of a paper (183 mm); text of 8 to 10 points needs no scaling there."""


def create_figure(width_in: float, height_in: float) -> Figure:
    """Create an empty white figure with constrained layout."""
    return Figure(figsize=(width_in, height_in), facecolor="white", layout="constrained")


def create_axes(width_in: float, height_in: float) -> tuple[Figure, Axes]:
    """Create a figure with a single panel in the common style."""
    figure = create_figure(width_in, height_in)
    axes = figure.add_subplot()
    style_axes(axes)
    return figure, axes


def make_participant_handles(subjects: Sequence[str]) -> list[Line2D]:
    """Make the legend's entries of the participants; none where they are more than `_LARGEST_LEGEND`."""
    return [
        Line2D([], [], color=choose_colour(index), marker=choose_marker(index), linewidth=0, label=subject)
        for index, subject in enumerate(subjects if len(subjects) <= _LARGEST_LEGEND else ())
    ]


def choose_height_in(legend_handles: Sequence[Line2D], least_in: float) -> float:
    """Choose the height (inches) of a figure with a legend of 8.5 points beside its axes: at least `least_in`, and
    enough for all entries."""
    further_lines = sum(str(handle.get_label()).count("\n") for handle in legend_handles)
    # Heights measured: 0.19 in for an entry of a single line, 0.14 in for each further line; 0.3 in for the margins.
    return max(least_in, 0.19 * len(legend_handles) + 0.14 * further_lines + 0.3)


def style_axes(axes: Axes) -> None:
    """Draw a light grid behind the data, and hide the top and right spines."""
    axes.set_axisbelow(True)
    axes.grid(True, color="#DDDDDD", linewidth=0.6)
    axes.tick_params(labelsize=9)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)


def choose_colour(participant_index: int) -> str:
    """Return the colour of a participant by index from 0; colours recur after the last of `COLOURS`."""
    return COLOURS[participant_index % len(COLOURS)]


def choose_marker(participant_index: int) -> str:
    """Return the marker of a participant by index from 0. Each further round of `COLOURS` begins one marker later, so
    that no two of the first 100 participants have both the same colour and the same marker."""
    return MARKERS[(participant_index + participant_index // len(COLOURS)) % len(MARKERS)]


def create_panel_grid(panel_count: int, height_in: float, sharex: bool = False) -> tuple[Figure, list[Axes]]:
    """Create a page-wide figure of up to three columns; returns it and its axes row by row, at least one more than
    panels, for the legend. Axes without a panel are switched off. height_in: height of a row of panels (inches)."""
    column_count = min(3, panel_count + 1)
    row_count = -(-(panel_count + 1) // column_count)
    figure = create_figure(PAGE_WIDTH_IN, height_in * row_count)
    grid = figure.subplots(row_count, column_count, sharex=sharex, sharey=True, squeeze=False)
    panel_axes = [axes for grid_row in grid for axes in grid_row]
    for axes in panel_axes[panel_count:]:
        axes.axis("off")
    return figure, panel_axes


def label_panel_axes(panel_axes: list[Axes], panel_count: int, x_label: str, y_label: str) -> None:
    """Set the axis labels below the lowest panel of each column and left of each row of `create_panel_grid`."""
    column_count = min(3, panel_count + 1)
    for panel_index in range(0, panel_count, column_count):
        panel_axes[panel_index].set_ylabel(y_label)
    for panel_index in range(max(0, panel_count - column_count), panel_count):
        panel_axes[panel_index].set_xlabel(x_label)
        panel_axes[panel_index].tick_params(labelbottom=True)


def set_newton_ticks(axis: Axis, lowest_n: float, highest_n: float) -> None:
    """Set ticks at 1, 2 and 5 times powers of ten from 0.01 to 2 N, and at 3 N, on a logarithmic axis, as decimals;
    those from lowest_n to highest_n only. On axes of more than two and a half decades, where these would overlap, at
    most five powers of ten; where there are fewer than two, those of `set_ratio_ticks`. Call after the scale is set."""
    tick_levels_n = [
        level_n for level_n in (0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 3.0) if lowest_n <= level_n <= highest_n
    ]
    decades = np.log10(highest_n / lowest_n)
    if decades > 2.5:
        exponents = np.arange(np.floor(np.log10(highest_n)), np.log10(lowest_n), -np.ceil(decades / 5))
        tick_levels_n = [float(10.0**exponent) for exponent in exponents]
    if len(tick_levels_n) < 2:
        set_ratio_ticks(axis, lowest_n, highest_n)
        return
    axis.set_ticks(tick_levels_n, labels=[f"{level_n:g}" for level_n in tick_levels_n])
    axis.set_ticks([], minor=True)


def set_ratio_ticks(axis: Axis, low: float, high: float) -> None:
    """Set ticks from low to high (both > 0) on a logarithmic axis, at the multiples of powers of ten of
    `_TICK_MULTIPLES`, fewer for more decades; where there are fewer than two, at equal distances. Call after the scale
    is set."""
    decades = np.log10(high / low)
    tick_multiples = next(
        candidate_multiples for most_decades, candidate_multiples in _TICK_MULTIPLES if decades <= most_decades
    )
    exponents = range(int(np.floor(np.log10(low))), int(np.ceil(np.log10(high))) + 1)
    candidate_values = [multiple * 10.0**exponent for exponent in exponents for multiple in tick_multiples]
    tick_values = [value for value in candidate_values if low <= value <= high]
    if len(tick_values) < 2:
        even_values = MaxNLocator(4, steps=[1, 2, 5, 10]).tick_values(low, high)
        tick_values = [float(value) for value in even_values if low <= value <= high]
    axis.set_ticks(tick_values, labels=[f"{value:.10g}" for value in tick_values])
    axis.set_ticks([], minor=True)


def format_power_of_ten(value: float) -> str:
    """Format a value, rounded to a power of ten, as text, such as "10⁻³" for 0.001; empty for 0 or less. Plain text,
    because the first use of Matplotlib's mathtext takes a second."""
    return "10" + f"{np.log10(value):.0f}".translate(_SUPERSCRIPTS) if value > 0 else ""


def draw_no_data_note(figure: Figure, note: str) -> Figure:
    """Write a note in the middle of an empty figure in place of a plot, and return the figure."""
    figure.text(0.5, 0.5, note, ha="center", va="center", fontsize=11, color=GREY)
    return figure
