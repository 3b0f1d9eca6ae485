"""Figures of a recording before any model is fitted: time series, spectra, coherence, levels, derivatives.

They show the values of `analysis.look.overview.Overview`; a figure without data is left out.
"""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from analysis.diagnosis.types import Mask
from analysis.figures.picture import Picture, convert_to_sample_units
from analysis.figures.style import (
    BLACK,
    BLUE,
    COLOURS,
    GREY,
    MARKERS,
    ORANGE,
    SKY,
    create_axes,
    create_figure,
    style_axes,
)
from analysis.look.channels import Channel
from analysis.look.kinematics import KinematicPair, differentiate
from analysis.look.overview import Overview
from equalizer.signals.signal import FloatArray

ENVELOPE_COLUMNS = 1200
"""Largest number of columns of a drawn time series, each from its lowest to its highest sample. The numbers of this
module are chosen by hand."""
SHOWN_SAMPLES = 600
"""Largest number of samples that are shown where two time series are compared."""
_FIT_COLOUR, _TEST_COLOUR, _BAND_COLOUR = "#EEF3E6", "#FBEFD9", "#EEF3E6"
"""Background colours of samples to fit, of samples to test, and of the driven band."""
_SHOWN_DECADES = 8
"""Decades of amplitude that a spectrum shows, from its largest value down."""
_ROLE_COLOURS = {"command": ORANGE, "excitation": ORANGE, "response": BLUE, "position": SKY, "condition": GREY}


def make_look_pictures(overview: Overview, recording_number: int) -> tuple[Picture, ...]:
    """Make all figures of one recording; in samples instead of seconds where its time axis is unknown.
    recording_number: its number on the page, from 1, for the names of the pictures."""
    pictures = [_make_signals_picture(overview, f"signals-{recording_number}")]
    if overview.spectra is not None:
        pictures.append(_make_spectra_picture(overview, f"spectra-{recording_number}"))
    if overview.coherences:
        pictures.append(_make_coherence_picture(overview, f"coherence-{recording_number}"))
    if len(overview.levels) > 2:
        pictures.append(_make_levels_picture(overview, f"levels-{recording_number}"))
    if overview.pairs:
        pictures.append(_make_derivatives_picture(overview, f"derivatives-{recording_number}"))
    return tuple(pictures if overview.recording.is_timed else map(convert_to_sample_units, pictures))


def _make_channel_panels(overview: Overview, height_in: float) -> tuple[Figure, list[Axes]]:
    """Make a figure with a titled panel per channel. height_in: height of a panel in inches."""
    figure = create_figure(8.6, 0.8 + height_in * len(overview.channels))
    axes = figure.subplots(len(overview.channels), 1, sharex=True, squeeze=False)[:, 0]
    for channel, panel in zip(overview.channels, axes, strict=True):
        style_axes(panel)
        panel.set_title(f"{channel.role} {channel.name} ({_format_unit(channel.unit)})", fontsize=9, loc="left", pad=3)
    return figure, list(axes)


def _make_signals_picture(overview: Overview, name: str) -> Picture:
    """Make the picture of the time series of all channels, with the samples to fit and to test, and gaps in time."""
    figure, axes = _make_channel_panels(overview, 1.15)
    rate_hz = overview.recording.sample_rate_hz
    for channel, panel in zip(overview.channels, axes, strict=True):
        times_s, low, high = compute_envelope(channel.samples, rate_hz)
        panel.fill_between(times_s, low, high, color=_ROLE_COLOURS[channel.role], linewidth=0.6)
        for segment in overview.recording.segments:
            if segment.role:
                role_colour = _FIT_COLOUR if segment.role == "fit" else _TEST_COLOUR
                panel.axvspan(segment.start / rate_hz, segment.stop / rate_hz, color=role_colour, zorder=0, linewidth=0)
        for start, _ in overview.stretches[1:]:
            panel.axvline(start / rate_hz, color=GREY, linewidth=0.7, linestyle=(0, (1, 2)))
    figure.supxlabel("Time (s)", fontsize=10)
    handles = [Patch(color=_FIT_COLOUR, label="to fit"), Patch(color=_TEST_COLOUR, label="to test")]
    if any(segment.role for segment in overview.recording.segments):
        figure.legend(handles=handles, loc="outside upper center", ncols=2, fontsize=8.5, frameon=False)
    return Picture(
        name=name,
        title="Signals",
        caption="Every channel from its lowest to its highest sample in each column of the picture. Shades: samples "
        "marked to fit and to test. Dotted: where one part ends and the next begins.",
        figure=figure,
    )


def compute_envelope(
    samples: FloatArray, rate_hz: float, most_columns: int = ENVELOPE_COLUMNS
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Compute start times (s), lowest and highest samples of about equally long columns, (k,) each, k at most
    `most_columns`. Missing samples (NaN) are ignored."""
    starts = np.unique(np.linspace(0, len(samples), min(most_columns, len(samples)), endpoint=False).astype(int))
    low = np.fmin.reduceat(samples, starts)
    high = np.fmax.reduceat(samples, starts)
    # Each column is extended to touch the one before it, so that steep curves have no gaps.
    low[1:], high[1:] = np.fmin(low[1:], high[:-1]), np.fmax(high[1:], low[:-1])
    return starts / rate_hz, low, high


def _make_spectra_picture(overview: Overview, name: str) -> Picture:
    """Make the picture of the amplitude densities of all channels, in their units per √Hz."""
    assert overview.spectra is not None
    figure, axes = _make_channel_panels(overview, 1.25)
    frequency_hz = overview.spectra.frequency_hz
    for channel_index, (channel, panel) in enumerate(zip(overview.channels, axes, strict=True)):
        amplitude_density = np.sqrt(overview.spectra.get_power_density(channel_index))
        if np.nanmin(channel.samples) == np.nanmax(channel.samples):
            panel.text(0.5, 0.5, "constant", transform=panel.transAxes, ha="center", fontsize=9, color=GREY)
            continue
        panel.plot(
            frequency_hz,
            np.where(amplitude_density > 0, amplitude_density, np.nan),
            color=_ROLE_COLOURS[channel.role],
            lw=1.0,
        )
        panel.set_yscale("log")
        if amplitude_density.max() > 0:
            largest_density = float(amplitude_density.max())
            panel.set_ylim(
                max(
                    0.5 * float(amplitude_density[amplitude_density > 0].min()), largest_density * 10.0**-_SHOWN_DECADES
                ),
                2 * largest_density,
            )
        _shade_bands(panel, overview)
    axes[0].set_xscale("log")
    axes[0].set_xlim(float(frequency_hz[0]), float(frequency_hz[-1]))
    figure.supxlabel("Frequency (Hz)", fontsize=10)
    figure.supylabel("Amplitude density (unit per √Hz)", fontsize=10)
    step_hz = float(frequency_hz[0])
    return Picture(
        name=name,
        title="Spectra",
        caption=f"Mean of {overview.spectra.windows} windows of {1 / step_hz:.3g} s (Hann window, half overlap, linear "
        "trend removed). Shade: from the lowest to the highest frequency that a command was driven at.",
        figure=figure,
    )


def _shade_bands(panel: Axes, overview: Overview) -> None:
    """Shade from the lowest to the highest driven frequency, where any is driven."""
    if overview.bands:
        low_hz, high_hz = min(band.low_hz for band in overview.bands), max(band.high_hz for band in overview.bands)
        panel.axvspan(low_hz, high_hz, color=_BAND_COLOUR, zorder=0)


def _select_band_lines(overview: Overview) -> Mask:
    """Select the spectral lines from the lowest to the highest driven frequency, as a mask (lines,)."""
    assert overview.spectra is not None
    low_hz, high_hz = min(band.low_hz for band in overview.bands), max(band.high_hz for band in overview.bands)
    return np.asarray((overview.spectra.frequency_hz >= low_hz) & (overview.spectra.frequency_hz <= high_hz))


def _make_coherence_picture(overview: Overview, name: str) -> Picture:
    """Make the picture of the multiple coherence of each response with all commands; faint outside the driven band."""
    assert overview.spectra is not None
    figure, panel = create_axes(8.6, 3.0)
    _shade_bands(panel, overview)
    for response_index, coherence in enumerate(overview.coherences):
        colour = COLOURS[response_index % len(COLOURS)]
        panel.plot(overview.spectra.frequency_hz, coherence.multiple, color=colour, lw=0.7, alpha=0.3)
        is_in_band = _select_band_lines(overview)
        panel.plot(
            overview.spectra.frequency_hz[is_in_band],
            coherence.multiple[is_in_band],
            color=colour,
            lw=1.3,
            label=coherence.response,
        )
    panel.set_xscale("log")
    panel.set_xlim(float(overview.spectra.frequency_hz[0]), float(overview.spectra.frequency_hz[-1]))
    panel.set_ylim(0, 1.02)
    panel.set_xlabel("Frequency (Hz)", fontsize=10)
    panel.set_ylabel("Multiple coherence", fontsize=10)
    figure.legend(loc="outside upper center", ncols=min(4, len(overview.coherences)), fontsize=8.5, frameon=False)
    return Picture(
        name=name,
        title="Coherence",
        caption="Share of each response's power that all commands together explain linearly (multiple coherence), "
        "less the share that this number of windows explains by chance. Shade: driven band; outside it (faint) "
        "chance and noise dominate.",
        figure=figure,
    )


def _make_levels_picture(overview: Overview, name: str) -> Picture:
    """Make the picture of the rms of each command and response by segment, relative to its largest; for a linear device
    the curves coincide."""
    figure, panel = create_axes(8.6, 3.2)
    segment_numbers = [level.number for level in overview.levels]
    largest_rms = [max(level.rms[column] for level in overview.levels) for column in range(len(overview.channels))]
    drawn_channels = [
        column
        for column, channel in enumerate(overview.channels)
        if channel.role in ("command", "response") and largest_rms[column] > 0
    ]
    for curve_index, column in enumerate(drawn_channels):
        relative_rms = np.array([level.rms[column] for level in overview.levels]) / largest_rms[column]
        panel.plot(
            segment_numbers,
            np.where(relative_rms > 0, relative_rms, np.nan),
            color=COLOURS[curve_index % len(COLOURS)],
            marker=MARKERS[curve_index % len(MARKERS)],
            markersize=5,
            linewidth=0.8,
            linestyle=":" if overview.channels[column].role == "command" else "-",
            label=f"{overview.channels[column].label} "
            f"({_format_unit(overview.channels[column].format(largest_rms[column]))})",
        )
    panel.set_ylim(0, 1.05)
    panel.set_xlabel("Segment", fontsize=10)
    panel.set_ylabel("Rms over that of the strongest", fontsize=10)
    panel.xaxis.set_major_locator(MaxNLocator(integer=True))
    if drawn_channels:
        figure.legend(loc="outside upper center", ncols=2, fontsize=8.5, frameon=False)
    return Picture(
        name=name,
        title="Levels",
        caption="Rms of each command and response in every segment, over its largest one (in brackets). Where a "
        "response does not follow its command, the device is not linear.",
        figure=figure,
    )


def _make_derivatives_picture(overview: Overview, name: str) -> Picture:
    """Make the picture of recorded velocities or accelerations and the differentiated signals of the same motion."""
    pairs = overview.pairs
    figure = create_figure(8.6, 0.8 + 1.9 * len(pairs))
    axes = figure.subplots(len(pairs), 1, squeeze=False)[:, 0]
    for pair, panel in zip(pairs, axes, strict=True):
        _draw_pair(panel, pair, overview)
    handles = [
        Line2D([], [], color=BLACK, linewidth=2.2, alpha=0.35, label="recorded"),
        Line2D([], [], color=BLUE, linewidth=1.0, label="differentiated position or speed"),
    ]
    figure.legend(handles=handles, loc="outside upper center", ncols=2, fontsize=8.5, frameon=False)
    figure.supxlabel("Time (s)", fontsize=10)
    return Picture(
        name=name,
        title="Derivatives",
        caption="The stretch with the most motion: the recorded signal, and central differences of the position or "
        "speed of the same motion.",
        figure=figure,
    )


def _draw_pair(panel: Axes, pair: KinematicPair, overview: Overview) -> None:
    """Draw a recorded channel, and central differences of the channel whose derivative it should be."""
    rate_hz = overview.recording.sample_rate_hz
    channels_by_label = {channel.label: channel for channel in overview.channels}
    recorded = channels_by_label[pair.derivative]
    start, stop = _find_most_varying_part(recorded, overview.stretches)
    times_s = np.arange(start, stop) / rate_hz
    # Differences within this stretch only: positions jump where two parts of a recording meet.
    differences = differentiate(channels_by_label[pair.place].samples[start:stop], pair.order, rate_hz)
    style_axes(panel)
    panel.plot(times_s, recorded.samples[start:stop], color=BLACK, linewidth=2.2, alpha=0.35)
    panel.plot(times_s, differences, color=BLUE, linewidth=1.0)
    panel.set_title(
        f"{pair.derivative} ({_format_unit(recorded.unit)}) and {pair.place}", fontsize=9, loc="left", pad=3
    )
    panel.set_xlim(float(times_s[0]), float(times_s[-1]))


def _find_most_varying_part(channel: Channel, stretches: Sequence[tuple[int, int]]) -> tuple[int, int]:
    """Find first and end sample (exclusive) of the `SHOWN_SAMPLES` successive samples, or of a whole shorter stretch,
    in which the channel's variance is largest; missing samples count as the mean."""
    largest_variance, most_varying_part = -1.0, stretches[0]
    for start, stop in stretches:
        centred = np.nan_to_num(channel.samples[start:stop] - np.nanmean(channel.samples))
        length = min(SHOWN_SAMPLES, len(centred))
        sums, sums_of_squares = (np.concatenate([[0.0], np.cumsum(summands)]) for summands in (centred, centred**2))
        mean = (sums[length:] - sums[:-length]) / length
        variance = (sums_of_squares[length:] - sums_of_squares[:-length]) / length - mean**2
        if variance.max() > largest_variance:
            first_sample = start + int(np.argmax(variance))
            largest_variance, most_varying_part = float(variance.max()), (first_sample, first_sample + length)
    return most_varying_part


def _format_unit(unit: str) -> str:
    """Format a unit, or a value with its unit, with a raised 2; "no unit" for "1"."""
    return "no unit" if unit == "1" else unit.replace("^2", "²")
