"""Figure of the magnitude response from target to delivered acceleration, with and without equalizer (published
figure 5).

Each row of panels is one condition (centre or edge of the workspace, equalizer, friction), each column the axis of the
target acceleration. A perfect equalizer gives 0 dB along that axis and no response along the others. `played_response`
defines the response.
"""

from collections.abc import Sequence
from textwrap import fill

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from analysis.evaluation.reproduction.played_response import PlayedResponse
from analysis.figures.picture import Picture
from analysis.figures.style import BLUE, GREEN, GREY, VERMILLION, create_figure, draw_no_data_note, style_axes

_AXES = "xyz"
"""Names of the axes, in the order of the response's rows and columns."""
_COLOURS = (BLUE, VERMILLION, GREEN)
"""Colours of the delivered axes x, y, z."""
_LOWEST_DB, _HIGHEST_DB = -55.0, 12.0
"""Range of the vertical axis (dB). Chosen."""
_TICKS_HZ = (5, 10, 20, 35)
"""Ticks of the frequency axis, as in the published figure."""


def make_played_responses_picture(playbacks: Sequence[PlayedResponse]) -> Picture:
    """Make the picture of delivered over target acceleration without and with equalizer. playbacks: one per row."""
    return Picture(
        name="equalized-response",
        title="Response from target to delivered acceleration, with and without the equalizer",
        caption="Columns: axis of the target acceleration, a swept sine. Thick: delivered acceleration along this "
        "axis, ideally 0 dB; thin: along the other axes. Delivered is the true acceleration of the simulated handle, "
        "at each spectral line. First row: a force proportional to the target, scaled by the mean gain. Last row (not "
        "in the publication): forces interpolated between models of other places.",
        figure=draw_played_responses(playbacks),
    )


def make_friction_picture(playbacks: Sequence[PlayedResponse]) -> Picture:
    """Make the picture of delivered over target acceleration with and without friction. playbacks: one per row."""
    return Picture(
        name="equalized-friction",
        title="Effect of friction on the delivered acceleration",
        caption="Responses from target to delivered acceleration, as in the figure above. First row: a swept sine. "
        "Second row: all frequencies at once with the same peak force, so that each has less force: friction, which no "
        "linear model contains, makes the lines scatter. Last row: the same on a copy of the simulated device without "
        "friction, with a model identified on it; the remaining coupling is the accelerometer's mounting error.",
        figure=draw_played_responses(playbacks),
    )


def draw_played_responses(playbacks: Sequence[PlayedResponse]) -> Figure:
    """Draw a row of panels per response and three columns, one per axis of the target acceleration; a note where there
    are no responses."""
    if not playbacks:
        return draw_no_data_note(create_figure(8.6, 2.0), "Nothing was played.")
    figure = create_figure(8.6, 0.8 + 1.75 * len(playbacks))
    grid = figure.subplots(len(playbacks), 3, sharex=True, sharey=True, squeeze=False)
    for panels, playback in zip(grid, playbacks, strict=True):
        for target_axis, axes in enumerate(panels):
            _draw_panel(axes, playback, target_axis)
        panels[0].set_ylabel(f"{fill(playback.name, 18)}\n(dB)", fontsize=9)
    for target_axis, name in enumerate(_AXES):
        grid[0][target_axis].set_title(f"target along {name}", fontsize=10)
        grid[-1][target_axis].set_xlabel("Frequency (Hz)")
    handles = [
        Line2D([], [], color=colour, label=f"delivered along {name}")
        for colour, name in zip(_COLOURS, _AXES, strict=True)
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=3, fontsize=9, frameon=False)
    return figure


def _draw_panel(axes: Axes, playback: PlayedResponse, target_axis: int) -> None:
    """Draw |T| (dB) over frequency for the three delivered axes, the target's with a thicker line. target_axis: index
    of the axis of the target."""
    style_axes(axes)
    axes.axhline(0, color=GREY, linewidth=0.8)
    for delivered_axis, colour in enumerate(_COLOURS):
        # -180 dB at the least, far below the axis: the logarithm of 0 is never taken.
        level_db = 20 * np.log10(np.maximum(np.abs(playback.response[:, delivered_axis, target_axis]), 1e-9))
        is_target = delivered_axis == target_axis
        axes.plot(
            playback.frequency_hz,
            level_db,
            color=colour,
            linewidth=1.8 if is_target else 0.8,
            zorder=3 if is_target else 2,
        )
    axes.set_xscale("log")
    axes.set_xlim(float(playback.frequency_hz[0]), float(playback.frequency_hz[-1]))
    axes.set_ylim(_LOWEST_DB, _HIGHEST_DB)
    axes.set_xticks(_TICKS_HZ)
    axes.xaxis.set_major_formatter("{x:g}")
    axes.xaxis.set_minor_formatter("")
