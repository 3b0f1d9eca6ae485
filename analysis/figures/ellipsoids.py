"""Figure of acceleration ellipses by frequency, by second moments and by phasors.

As figure 3 of Wilson, Chan, Salisbury and Niemeyer, Multi-DOF Equalization of Haptic Devices.
`analysis.psychophysics.ellipsoid` defines both ellipses and the frame: the first axis is the test direction. Sizes of
the figure are chosen by eye.
"""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.typing import LineStyleType

from analysis.figures.style import BLUE, GREEN, GREY, ORANGE, PURPLE, VERMILLION, create_figure, draw_no_data_note
from analysis.psychophysics.ellipsoid import EllipsoidResult
from analysis.wording import format_number

_MAX_COLUMNS = 6
"""Largest number of frequencies in a row of panels."""
_COLOURS = (BLUE, VERMILLION, GREEN, ORANGE, PURPLE)
_LINE_STYLES: tuple[LineStyleType, ...] = ("-", "--", "-.", ":", (0, (5, 1)))
"""Five colours and five dashes of the test directions, in order of appearance: direction k has those with the index k
modulo 5."""


def draw_ellipsoids(results: Sequence[EllipsoidResult]) -> Figure:
    """Draw a column per frequency: above the ellipse by second moments, below by phasors, each scaled to its largest
    semi-axis. After `_MAX_COLUMNS` frequencies a new pair of rows begins.

    The horizontal line is the test direction. Repeats are drawn over each other; test directions differ by colour and
    dash. A note is drawn where there are no results.
    """
    if not results:
        return draw_no_data_note(create_figure(8.6, 2.0), "There is no ellipsoid to draw.")
    frequencies_hz = sorted({result.frequency_hz for result in results})
    directions = list(dict.fromkeys(result.along for result in results))
    # In units of the largest semi-axis: a margin of 10 %, and at least 0.44 for narrow ellipses.
    half_height = 1.1 * max(0.4, *(_compute_half_height(result) for result in results))
    column_count = min(_MAX_COLUMNS, len(frequencies_hz))
    block_count = -(-len(frequencies_hz) // column_count)
    figure = create_figure(8.6, (1.6 + 2 * min(2.0, 8.0 / column_count) * half_height / 1.15) * block_count + 0.4)
    grid = figure.subplots(2 * block_count, column_count, squeeze=False, sharex=True, sharey=True)
    for grid_row in grid:
        for axes in grid_row:
            axes.axis("off")
    for index, frequency_hz in enumerate(frequencies_hz):
        block, column = divmod(index, column_count)
        frequency_results = [result for result in results if result.frequency_hz == frequency_hz]
        _draw_panels(grid[2 * block][column], grid[2 * block + 1][column], frequency_results, directions, half_height)
    legend_handles = [
        Line2D(
            [],
            [],
            color=_COLOURS[direction_index % 5],
            linestyle=_LINE_STYLES[direction_index % 5],
            label=direction.replace("_", " "),
        )
        for direction_index, direction in enumerate(directions)
    ]
    legend_handles.append(Line2D([], [], color=GREY, linewidth=0.9, label="test direction"))
    figure.legend(
        handles=legend_handles, loc="outside lower center", ncols=len(legend_handles), fontsize=9, frameon=False
    )
    return figure


def _draw_panels(
    moment_axes: Axes,
    phasor_axes: Axes,
    frequency_results: list[EllipsoidResult],
    directions: list[str],
    half_height: float,
) -> None:
    """Draw both panels of one frequency. frequency_results: at least one. half_height: of a panel, in units of the
    largest semi-axis. Ratio and tilt are written in the titles where there is a single result."""
    for axes in (moment_axes, phasor_axes):
        axes.set_aspect("equal")
        axes.set_xlim(-1.15, 1.15)
        axes.set_ylim(-half_height, half_height)
        axes.plot([-1.12, 1.12], [0, 0], color=GREY, linewidth=0.9)
        axes.plot([0, 0], [-0.06, 0.06], color=GREY, linewidth=0.9)
    first_result, is_single = frequency_results[0], len(frequency_results) == 1
    moment_axes.set_title(
        f"{first_result.frequency_hz:g} Hz\nmean squares"
        + (
            _format_ellipse_label(first_result.moments.normalised_axes[1], first_result.moments.tilt_deg)
            if is_single
            else ""
        ),
        fontsize=9,
    )
    phasor_axes.set_title(
        "phasors"
        + (_format_ellipse_label(first_result.phasor.ellipticity, first_result.phasor.tilt_deg) if is_single else ""),
        fontsize=9,
    )
    for result in frequency_results:
        direction_index = directions.index(result.along)
        colour, style = _COLOURS[direction_index % 5], _LINE_STYLES[direction_index % 5]
        _draw_ellipse(moment_axes, result.moments.normalised_axes[1], result.moments.turn_deg, colour, style)
        _draw_ellipse(phasor_axes, result.phasor.ellipticity, result.phasor.turn_deg, colour, style)


def _format_ellipse_label(ratio: float, tilt_deg: float) -> str:
    """Format the ratio of the semi-axes and the tilt of an ellipse as a line of a title."""
    return f"\n1 : {ratio:.2f}, tilt {format_number(tilt_deg, 0)}°"


def _compute_half_height(result: EllipsoidResult) -> float:
    """Compute the half extent, perpendicular to the test direction, of that of both ellipses which extends further, in
    units of its largest semi-axis: hypot(sin(turn), ratio cos(turn))."""
    shapes = (
        (result.moments.normalised_axes[1], result.moments.turn_deg),
        (result.phasor.ellipticity, result.phasor.turn_deg),
    )
    return max(
        float(np.hypot(np.sin(np.radians(turn_deg)), ratio * np.cos(np.radians(turn_deg))))
        for ratio, turn_deg in shapes
    )


def _draw_ellipse(axes: Axes, ratio: float, turn_deg: float, colour: str, style: LineStyleType) -> None:
    """Draw an ellipse with semi-axes 1 and `ratio`, turned by turn_deg (degrees) counter-clockwise."""
    angle, turn_rad = np.linspace(0, 2 * np.pi, 181), np.radians(turn_deg)
    x, y = np.cos(angle), ratio * np.sin(angle)
    axes.plot(
        x * np.cos(turn_rad) - y * np.sin(turn_rad),
        x * np.sin(turn_rad) + y * np.cos(turn_rad),
        color=colour,
        linestyle=style,
        linewidth=1.6,
    )
