"""Figure of the measured transfer functions from every force to every acceleration (the published figure 4).

Magnitude over frequency, both logarithmic, a panel per entry of the transfer matrix. Lines are averaged over bins of
1/24 octave (`octave_bins`); the range of single lines and their expected noise are drawn as well, and on request the
response of a fitted model.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from analysis.figures.picture import Picture
from analysis.figures.style import BLUE, GREY, ORANGE, SKY, VERMILLION, create_figure, draw_no_data_note, style_axes
from equalizer.identification.frequency_response.frequency_response import FrequencyResponse
from equalizer.identification.frequency_response.octave_bins import OctaveBins, average_octave_bins
from equalizer.signals.signal import BoolArray, ComplexArray, FloatArray

_BIN_WIDTH_OCTAVES = 1 / 24
"""Width of a bin in which lines are averaged for drawing, octaves. Chosen; the caption states it."""
_UNRELIABLE_COLOUR = "#B8B8B8"
_BAND_COLOUR = "#EEF3E6"


@dataclass(frozen=True, slots=True, eq=False)
class ResponseCurve:
    """A response to draw on top of the measured response, such as that of a fitted model."""

    name: str
    """Label in the legend."""
    frequency_hz: FloatArray
    """(lines,), Hz."""
    response: ComplexArray
    """(lines, outputs, inputs), complex, in the unit of the measured response."""


def make_transfer_functions_picture(
    response: FrequencyResponse, model: ResponseCurve | None = None, band_hz: tuple[float, float] | None = None
) -> Picture:
    """Make the picture of all transfer functions with its caption. band_hz: band to mark in every panel, as that of a
    fit."""
    return Picture(
        name="transfer-functions",
        title="Transfer functions of all channels",
        caption="From each commanded force (columns) to each measured acceleration (rows), at the handle. Line: mean "
        "over 1/24 octave; shade: from the weakest to the strongest single line in it; dotted: expected error of a "
        "single line. Grey: lines that should not be used. " + " ".join(response.remarks),
        figure=draw_transfer_functions(response, model, band_hz),
    )


def draw_transfer_functions(
    response: FrequencyResponse, model: ResponseCurve | None = None, band_hz: tuple[float, float] | None = None
) -> Figure:
    """Draw the magnitudes of all entries, a row per output and a column per input; a note without any line. model:
    drawn dashed; band_hz: drawn shaded."""
    if not len(response):
        return draw_no_data_note(create_figure(8.6, 2.0), "There is no line to draw.")
    output_count, input_count = response.response.shape[1:]
    figure = create_figure(8.6, 0.9 + 2.05 * output_count)
    axes_grid = figure.subplots(output_count, input_count, sharex=True, sharey=True, squeeze=False)
    bins = average_octave_bins(response, _BIN_WIDTH_OCTAVES)
    for row, output in enumerate(response.output_channels):
        for column, input_ in enumerate(response.input_channels):
            axes: Axes = axes_grid[row][column]
            _draw_entry(axes, bins, row, column)
            if band_hz is not None:
                axes.axvspan(*band_hz, color=_BAND_COLOUR, zorder=0)
            if model is not None:
                axes.plot(model.frequency_hz, np.abs(model.response[:, row, column]), "--", color=VERMILLION, lw=1.2)
            axes.set_title(f"{input_} → {output}", fontsize=9, loc="left", pad=3)
    _scale_axes(axes_grid[0][0], bins)
    figure.supylabel(
        f"Magnitude ({_typeset_units(response.output_units)} per {_typeset_units(response.input_units)})", fontsize=10
    )
    figure.supxlabel("Frequency (Hz)", fontsize=10)
    legend_handles = _make_legend_handles(bins, model, band_hz)
    figure.legend(
        handles=legend_handles, loc="outside upper center", ncols=len(legend_handles), fontsize=8.5, frameon=False
    )
    return figure


def _draw_entry(axes: Axes, bins: OctaveBins, row: int, column: int) -> None:
    """Draw one entry: mean magnitude, range of single lines, and expected noise of a line (standard deviation)."""
    style_axes(axes)
    mean_magnitude = np.abs(bins.response[:, row, column])
    lowest_magnitude, highest_magnitude = bins.lowest[:, row, column], bins.highest[:, row, column]
    for mask, line_colour, shade_colour in (
        (~bins.reliable, _UNRELIABLE_COLOUR, "#E6E6E6"),
        (bins.reliable, BLUE, SKY),
    ):
        extended_mask = _extend_mask(mask)
        axes.fill_between(
            bins.frequency_hz,
            lowest_magnitude,
            highest_magnitude,
            where=extended_mask.tolist(),
            color=shade_colour,
            alpha=0.45,
            linewidth=0,
        )
        axes.plot(bins.frequency_hz, np.where(extended_mask, mean_magnitude, np.nan), color=line_colour, linewidth=1.2)
    noise_sd = np.sqrt(bins.noise_variance[:, row, column])
    axes.plot(bins.frequency_hz, noise_sd, ":", color=ORANGE, linewidth=1.1)


def _extend_mask(mask: BoolArray) -> BoolArray:
    """Extend the mask (bins,) by the bin after each true bin, so that a curve that changes its colour has no gap."""
    extended_mask = mask.copy()
    extended_mask[1:] |= mask[:-1]
    return extended_mask


def _scale_axes(axes: Axes, bins: OctaveBins) -> None:
    """Set scales, limits and number formats of all panels: they share their axes. The lower limit of the magnitude is
    half its 1 % quantile, so that a single low bin does not set it."""
    axes.set_xscale("log")
    axes.set_yscale("log")
    # All lines are shown if none is above 1 Hz, as for slow or untimed recordings.
    lowest_hz = 1.0 if bins.frequency_hz[-1] > 1.0 else 0.0
    is_in_range = bins.frequency_hz >= lowest_hz
    axes.set_xlim(max(lowest_hz, float(bins.frequency_hz[0])), float(bins.frequency_hz[-1]))
    magnitude = np.abs(
        bins.response[is_in_range & bins.reliable if (is_in_range & bins.reliable).any() else is_in_range]
    )
    axes.set_ylim(0.5 * float(np.quantile(magnitude, 0.01)), 2.0 * float(magnitude.max()))
    axes.xaxis.set_major_formatter("{x:g}")
    axes.yaxis.set_major_formatter("{x:g}")
    axes.xaxis.set_minor_formatter("")
    axes.yaxis.set_minor_formatter("")


def _make_legend_handles(
    bins: OctaveBins, model: ResponseCurve | None, band_hz: tuple[float, float] | None
) -> Sequence[Line2D | Patch]:
    """Make the legend's handles for what the figure shows."""
    handles: list[Line2D | Patch] = [
        Line2D([], [], color=BLUE, linewidth=1.4, label="measured"),
        Patch(color=SKY, alpha=0.45, label="single lines"),
        Line2D([], [], color=ORANGE, linestyle=":", linewidth=1.4, label="noise of a line"),
    ]
    if not bins.reliable.all():
        handles.append(Line2D([], [], color=_UNRELIABLE_COLOUR, linewidth=1.4, label="not reliable"))
    if model is not None:
        handles.append(Line2D([], [], color=VERMILLION, linestyle="--", linewidth=1.4, label=model.name))
    if band_hz is not None:
        handles.append(
            Patch(facecolor=_BAND_COLOUR, edgecolor=GREY, linewidth=0.4, label=f"{band_hz[0]:g} to {band_hz[1]:g} Hz")
        )
    return handles


def _typeset_units(units: Sequence[str]) -> str:
    """Typeset the different ASCII units, such as m/s^2 with a superscript 2, separated by commas."""
    return ", ".join(dict.fromkeys(units)).replace("^2", "²")
