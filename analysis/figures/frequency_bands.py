"""Figure of coupling, direction perception and control method over frequency, as in the published figure 1.

Above: measured worst coupling and its onset. Below: where the axes of the device couple, where a person perceives
directions, and which control method suits each frequency band (`frequency_response.frequency_bands`).
"""

from collections.abc import Sequence
from textwrap import fill

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from analysis.figures.picture import Picture
from analysis.figures.style import BLACK, BLUE, GREEN, GREY, ORANGE, PURPLE, VERMILLION, create_figure, style_axes
from equalizer.identification.frequency_response.coupling import compute_worst_coupling
from equalizer.identification.frequency_response.coupling_onset import CouplingOnset
from equalizer.identification.frequency_response.frequency_bands import FrequencyBand
from equalizer.identification.frequency_response.frequency_response import FrequencyResponse
from equalizer.identification.frequency_response.octave_bins import average_octave_bins

_BAND_COLOURS = {"low": GREEN, "middle": BLUE, "high": PURPLE}
_HALF_HEIGHT, _EXTRA_HALF_HEIGHT = 0.4, 0.35
"""Half the height of a row, and additional half height of the row of control methods, in units of the ordinate. Chosen
by hand."""
_LETTERS_PER_AXES = 110
"""Approximate number of letters that fit into the width of the axes, for line breaks. Chosen by hand."""
_Fill = tuple[str, float]
"""Fill of a bar: colour and opacity (0 to 1)."""


def make_frequency_bands_picture(
    response: FrequencyResponse, onset: CouplingOnset, bands: Sequence[FrequencyBand], direction_limit_hz: float
) -> Picture:
    """Make the picture of coupling, direction perception and control by frequency band. response: inputs and outputs in
    the same frame. bands: from `frequency_bands`, at least one. direction_limit_hz: frequency from which directions are
    hardly perceived."""
    return Picture(
        name="frequency-bands",
        title="Frequency bands",
        caption="Above: response across over response along when one axis is driven, for the worst axis. Coupling "
        f"onset: {onset.rule}; the mark's width is its 95 % interval. Below: what the device does, what the person "
        "feels, and how each band is driven. " + " ".join(f"{band.name.capitalize()}: {band.reason}" for band in bands),
        figure=draw_frequency_bands(response, onset, bands, direction_limit_hz),
    )


def draw_frequency_bands(
    response: FrequencyResponse, onset: CouplingOnset, bands: Sequence[FrequencyBand], direction_limit_hz: float
) -> Figure:
    """Draw the measured coupling above, and perception and control by band below, over a logarithmic frequency axis.
    Parameters: as for `make_frequency_bands_picture`."""
    figure = create_figure(8.6, 4.6)
    coupling_axes, band_axes = figure.subplots(2, 1, sharex=True, height_ratios=[1.35, 1])
    lowest_hz, highest_hz = bands[0].low_hz, bands[-1].high_hz
    _draw_coupling(coupling_axes, response.select_band(lowest_hz, highest_hz), onset)
    _draw_rows(band_axes, onset, bands, direction_limit_hz)
    for axes in (coupling_axes, band_axes):
        for edge_hz in [band.low_hz for band in bands[1:]]:
            axes.axvline(edge_hz, color=BLACK, linewidth=0.9, linestyle=(0, (4, 3)), zorder=1)
    band_axes.set_xscale("log")
    band_axes.set_xlim(lowest_hz, highest_hz)
    band_axes.xaxis.set_major_formatter("{x:g}")
    band_axes.xaxis.set_minor_formatter("")
    band_axes.set_xlabel("Frequency (Hz)")
    return figure


def _draw_coupling(axes: Axes, response: FrequencyResponse, onset: CouplingOnset) -> None:
    """Draw the worst coupling, in per cent, of the reliable lines averaged over 1/24 octave, with the threshold of the
    onset."""
    style_axes(axes)
    reliable_lines = response.select_lines(response.reliable)
    if len(reliable_lines):
        octave_bins = average_octave_bins(reliable_lines, 1 / 24)
        axes.plot(
            octave_bins.frequency_hz, 100 * compute_worst_coupling(octave_bins.response), color=BLUE, linewidth=1.3
        )
    axes.set_yscale("log")
    axes.yaxis.set_major_formatter("{x:g} %")
    axes.yaxis.set_minor_formatter("")
    axes.set_ylabel("Worst coupling,\nacross / along")
    axes.axhline(100 * onset.threshold, color=GREY, linewidth=1, linestyle="--")
    axes.annotate(
        f"{100 * onset.threshold:g} %", (1, 100 * onset.threshold), xycoords=("axes fraction", "data"), xytext=(-3, 3),
        textcoords="offset points", ha="right", fontsize=8.5, color=GREY,
    )  # fmt: skip
    if onset.frequency_hz is not None:
        _mark_onset(axes, onset.frequency_hz, onset)


def _mark_onset(axes: Axes, frequency_hz: float, onset: CouplingOnset) -> None:
    """Mark the onset of coupling at `frequency_hz`, with its confidence interval, if known, as a shade."""
    threshold_percent = 100 * onset.threshold
    if onset.interval_hz is not None:
        axes.axvspan(*onset.interval_hz, color=VERMILLION, alpha=0.3, linewidth=0)
    axes.plot(frequency_hz, threshold_percent, "o", color=VERMILLION, markersize=6, zorder=4)
    label = "coupled from the start" if onset.is_at_lowest_line else f"coupling begins: {frequency_hz:.1f} Hz"
    axes.annotate(
        label, (frequency_hz, threshold_percent), xytext=(-8, 14), textcoords="offset points", ha="right", fontsize=9,
        color=VERMILLION,
    )  # fmt: skip


def _draw_rows(axes: Axes, onset: CouplingOnset, bands: Sequence[FrequencyBand], direction_limit_hz: float) -> None:
    """Draw three rows of bars: coupling of the device, direction perception, control method by band."""
    lowest_hz, highest_hz = bands[0].low_hz, bands[-1].high_hz
    onset_hz = highest_hz if onset.frequency_hz is None else min(max(onset.frequency_hz, lowest_hz), highest_hz)
    _draw_bar(axes, 2, (lowest_hz, onset_hz), "axes hardly couple", (GREY, 0.18))
    _draw_bar(axes, 2, (onset_hz, highest_hz), "axes couple", (GREY, 0.45))
    _draw_bar(axes, 1, (lowest_hz, direction_limit_hz), "directions are felt", (ORANGE, 0.45))
    _draw_bar(axes, 1, (direction_limit_hz, highest_hz), "hardly felt", (ORANGE, 0.18))
    for band in bands:
        letters_per_line = int(_LETTERS_PER_AXES * np.log(band.high_hz / band.low_hz) / np.log(highest_hz / lowest_hz))
        label = f"{band.name}\n{fill(band.method, max(letters_per_line, 10))}"
        _draw_bar(axes, 0, (band.low_hz, band.high_hz), label, (_BAND_COLOURS[band.name], 0.35))
    axes.set_yticks([2, 1, -_EXTRA_HALF_HEIGHT], ["Device", "Person", "Driven by"])
    axes.set_ylim(-1.2, 2.5)
    axes.tick_params(axis="y", length=0)
    for spine_side in ("top", "right", "left"):
        axes.spines[spine_side].set_visible(False)


def _draw_bar(axes: Axes, row: int, band_hz: tuple[float, float], label: str, fill_style: _Fill) -> None:
    """Draw a labelled bar over a frequency band; none for an empty band. row: ordinate; 0 is the taller row of
    methods."""
    low_hz, high_hz = band_hz
    if high_hz <= low_hz:
        return
    half_height = _HALF_HEIGHT + (_EXTRA_HALF_HEIGHT if row == 0 else 0.0)
    centre = row - (_EXTRA_HALF_HEIGHT if row == 0 else 0.0)
    axes.fill_between([low_hz, high_hz], centre - half_height, centre + half_height, color=fill_style, linewidth=0)
    axes.text(float(np.sqrt(low_hz * high_hz)), centre, label, ha="center", va="center", fontsize=8.5, linespacing=1.1)
