"""Figure of coupling, direction perception and control method over frequency, as in the published figure 1.

Above: measured worst coupling and its onset. Below: where the axes of the device couple, where a person perceives
directions, and which control method suits each frequency band (`frequency_bands`).
"""

from collections.abc import Sequence
from textwrap import fill

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, NullFormatter

from analysis.figures.picture import Picture
from analysis.figures.style import BLACK, BLUE, GREEN, GREY, ORANGE, PURPLE, VERMILLION, create_figure, style_axes
from equalizer.identification.frequency_response.coupling import compute_worst_coupling
from equalizer.identification.frequency_response.coupling_onset import CouplingOnset
from equalizer.identification.frequency_response.frequency_bands import FrequencyBand
from equalizer.identification.frequency_response.frequency_response import FrequencyResponse
from equalizer.identification.frequency_response.octave_bins import average_octave_bins

_COLOURS = {"low": GREEN, "middle": BLUE, "high": PURPLE}
_HALF_HEIGHT, _EXTRA_HALF_HEIGHT = 0.4, 0.35
"""Half the height of a row, and additional half height of the row of control methods, in units of the ordinate."""
_LETTERS_PER_AXES = 110
"""Approximate number of letters that fit into the width of the axes, for line breaks."""
_Shade = tuple[str, float]
"""Colour and opacity (0 to 1) of a bar."""


def frequency_bands_picture(
    response: FrequencyResponse, onset: CouplingOnset, bands: Sequence[FrequencyBand], direction_limit_hz: float
) -> Picture:
    """Picture of coupling, direction perception and control by frequency band. response: inputs and outputs in the same
    frame. bands: from `frequency_bands`, at least one. direction_limit_hz: frequency from which directions are hardly
    perceived."""
    return Picture(
        name="frequency-bands",
        title="Frequency bands",
        caption="Above: response across over response along when one axis is driven, for the worst axis. Coupling "
        f"onset: {onset.rule}; the mark's width is its 95 % interval. Below: what the device does, what the person "
        "feels, and how each band is driven. " + " ".join(f"{band.name.capitalize()}: {band.why}" for band in bands),
        figure=draw_frequency_bands(response, onset, bands, direction_limit_hz),
    )


def draw_frequency_bands(
    response: FrequencyResponse, onset: CouplingOnset, bands: Sequence[FrequencyBand], direction_limit_hz: float
) -> Figure:
    """Figure of the measured coupling above, and of perception and control by band below, over a logarithmic frequency
    axis."""
    figure = create_figure(8.6, 4.6)
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=[1.35, 1])
    lowest, highest = bands[0].low_hz, bands[-1].high_hz
    _draw_coupling(above, response.select_band(lowest, highest), onset)
    _draw_rows(below, onset, bands, direction_limit_hz)
    for axes in (above, below):
        for edge in [band.low_hz for band in bands[1:]]:
            axes.axvline(edge, color=BLACK, linewidth=0.9, linestyle=(0, (4, 3)), zorder=1)
    below.set_xscale("log")
    below.set_xlim(lowest, highest)
    below.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    below.xaxis.set_minor_formatter(NullFormatter())
    below.set_xlabel("Frequency (Hz)")
    return figure


def _draw_coupling(axes: Axes, response: FrequencyResponse, onset: CouplingOnset) -> None:
    """Worst coupling of the reliable lines in per cent, averaged over 1/24 octave, with the threshold of the onset."""
    style_axes(axes)
    lines = response.select_lines(response.reliable)
    if len(lines):
        bins = average_octave_bins(lines, 1 / 24)
        axes.plot(bins.frequency_hz, 100 * compute_worst_coupling(bins.response), color=BLUE, linewidth=1.3)
    axes.set_yscale("log")
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g} %"))
    axes.yaxis.set_minor_formatter(NullFormatter())
    axes.set_ylabel("Worst coupling,\nacross / along")
    axes.axhline(100 * onset.threshold, color=GREY, linewidth=1, linestyle="--")
    axes.annotate(
        f"{100 * onset.threshold:g} %", (1, 100 * onset.threshold), xycoords=("axes fraction", "data"), xytext=(-3, 3),
        textcoords="offset points", ha="right", fontsize=8.5, color=GREY,
    )  # fmt: skip
    if onset.frequency_hz is not None:
        _mark_onset(axes, onset.frequency_hz, onset)


def _mark_onset(axes: Axes, frequency_hz: float, onset: CouplingOnset) -> None:
    """Mark of the onset of coupling, with its confidence interval as a shade."""
    level = 100 * onset.threshold
    if onset.interval_hz is not None:
        axes.axvspan(*onset.interval_hz, color=VERMILLION, alpha=0.3, linewidth=0)
    axes.plot(frequency_hz, level, "o", color=VERMILLION, markersize=6, zorder=4)
    label = "coupled from the start" if onset.from_the_start else f"coupling begins: {frequency_hz:.1f} Hz"
    axes.annotate(
        label, (frequency_hz, level), xytext=(-8, 14), textcoords="offset points", ha="right", fontsize=9,
        color=VERMILLION,
    )  # fmt: skip


def _draw_rows(axes: Axes, onset: CouplingOnset, bands: Sequence[FrequencyBand], direction_limit_hz: float) -> None:
    """Three rows of bars: coupling of the device, direction perception, control method by band."""
    lowest, highest = bands[0].low_hz, bands[-1].high_hz
    coupled_hz = highest if onset.frequency_hz is None else min(max(onset.frequency_hz, lowest), highest)
    _draw_bar(axes, 2, (lowest, coupled_hz), "axes hardly couple", (GREY, 0.18))
    _draw_bar(axes, 2, (coupled_hz, highest), "axes couple", (GREY, 0.45))
    _draw_bar(axes, 1, (lowest, direction_limit_hz), "directions are felt", (ORANGE, 0.45))
    _draw_bar(axes, 1, (direction_limit_hz, highest), "hardly felt", (ORANGE, 0.18))
    for band in bands:
        letters_per_line = int(_LETTERS_PER_AXES * np.log(band.high_hz / band.low_hz) / np.log(highest / lowest))
        label = f"{band.name}\n{fill(band.method, max(letters_per_line, 10))}"
        _draw_bar(axes, 0, (band.low_hz, band.high_hz), label, (_COLOURS[band.name], 0.35))
    axes.set_yticks([2, 1, -_EXTRA_HALF_HEIGHT], ["Device", "Person", "Driven by"])
    axes.set_ylim(-1.2, 2.5)
    axes.tick_params(axis="y", length=0)
    for side in ("top", "right", "left"):
        axes.spines[side].set_visible(False)


def _draw_bar(axes: Axes, row: int, band_hz: tuple[float, float], label: str, colour: _Shade) -> None:
    """A labelled bar over a frequency band; none for an empty band. row: ordinate; 0 is the taller row of methods."""
    low_hz, high_hz = band_hz
    if high_hz <= low_hz:
        return
    half_height = _HALF_HEIGHT + (_EXTRA_HALF_HEIGHT if row == 0 else 0.0)
    middle = row - (_EXTRA_HALF_HEIGHT if row == 0 else 0.0)
    axes.fill_between([low_hz, high_hz], middle - half_height, middle + half_height, color=colour, linewidth=0)
    axes.text(float(np.sqrt(low_hz * high_hz)), middle, label, ha="center", va="center", fontsize=8.5, linespacing=1.1)
