"""Draw the channels of a recording with braille characters, in two lines of text each: time series and amplitude
spectra, so that a recording can be judged in a terminal."""

import itertools
from collections.abc import Iterable

import numpy as np

from analysis.look.channels import Channel, format_value
from analysis.look.overview import Overview
from equalizer.signals.signal import FloatArray
from study.tui.drawing.braille import Canvas

LABEL_COLUMNS, DRAWING_COLUMNS, DRAWING_ROWS = 24, 54, 2
"""Width of the label, and width and height of the drawing, in characters. Chosen: both fit into 80 columns."""
_SHOWN_DECADES = 4.0
"""Range of amplitudes that a spectrum shows, in decades below its maximum. Chosen: 80 dB."""


def draw_time_series(channel: Channel) -> Iterable[str]:
    """Draw a channel over time, as two lines: each column of dots spans the lowest to the highest of its samples. The
    extremes of the whole channel are written at the right, with their unit. A column without finite samples stays
    empty; a channel without any gives one line."""
    finite_samples = channel.finite_samples
    if not finite_samples.size:
        yield f"{_format_channel_label(channel)} {'':{DRAWING_COLUMNS}} no samples"
        return
    canvas = Canvas(DRAWING_COLUMNS, DRAWING_ROWS)
    low, high = float(finite_samples.min()), float(finite_samples.max())
    span = high - low or 1.0
    for x, (bottom, top) in enumerate(_compute_column_ranges(channel.samples, canvas.width)):
        if np.isfinite(bottom):
            top_y, bottom_y = (round((high - value) / span * (canvas.height - 1)) for value in (top, bottom))
            canvas.draw_line((x, top_y), (x, bottom_y))
    upper_line, lower_line = canvas.render_lines()
    yield f"{_format_channel_label(channel)} {upper_line:{DRAWING_COLUMNS}} {format_value(high, channel.unit)}".rstrip()
    yield f"{'':{LABEL_COLUMNS}} {lower_line:{DRAWING_COLUMNS}} {format_value(low, channel.unit)}".rstrip()


def _compute_column_ranges(samples: FloatArray, column_count: int) -> list[tuple[float, float]]:
    """Compute the lowest and highest finite sample in each of `column_count` equal parts of the channel; NaN for a part
    without one."""
    edges = np.linspace(0, len(samples), column_count + 1).astype(int)
    ranges = []
    for start, stop in itertools.pairwise(edges):
        column_samples = samples[start : max(stop, start + 1)]
        column_samples = column_samples[np.isfinite(column_samples)]
        ranges.append(
            (float(column_samples.min()), float(column_samples.max())) if column_samples.size else (np.nan, np.nan)
        )
    return ranges


def draw_spectra(overview: Overview) -> Iterable[str]:
    """Draw the amplitude spectral densities of command and response channels, the square roots of their power spectral
    densities, each as two lines with both axes logarithmic; the lowest frequency of the spectra must be above 0.
    Nothing is drawn without spectra; channels without power are left out."""
    if overview.spectra is None:
        return
    frequency_hz = overview.spectra.frequency_hz
    for channel_index, channel in enumerate(overview.channels):
        power_density = overview.spectra.get_power_density(channel_index)
        if channel.role not in ("command", "response") or power_density.max() <= 0:
            continue
        canvas = Canvas(DRAWING_COLUMNS, DRAWING_ROWS)
        # The factor 1.001 includes the highest frequency in the last column.
        edges_hz = np.geomspace(frequency_hz[0], frequency_hz[-1] * 1.001, canvas.width + 1)
        for x, (start_hz, stop_hz) in enumerate(itertools.pairwise(edges_hz)):
            # The largest line within the column; where low frequencies have none, interpolate between lines.
            column_density = power_density[(frequency_hz >= start_hz) & (frequency_hz < stop_hz)]
            peak_density = (
                float(column_density.max())
                if column_density.size
                else float(np.interp(start_hz, frequency_hz, power_density))
            )
            # Distance below the maximum over the range; 0.5 log10 of a power ratio is log10 of the amplitude ratio. The
            # bound 1e-99 avoids the logarithm of 0.
            depth = -0.5 * np.log10(max(peak_density / power_density.max(), 1e-99)) / _SHOWN_DECADES
            if depth <= 1:
                canvas.draw_line((x, round(depth * (canvas.height - 1))), (x, canvas.height - 1))
        upper_line, lower_line = canvas.render_lines()
        yield f"{_format_channel_label(channel)} {upper_line:{DRAWING_COLUMNS}} amplitude, {_SHOWN_DECADES:g} decades"
        frequency_range = f"{frequency_hz[0]:.3g} to {frequency_hz[-1]:.4g} Hz"
        yield f"{'':{LABEL_COLUMNS}} {lower_line:{DRAWING_COLUMNS}} {frequency_range}"


def _format_channel_label(channel: Channel) -> str:
    """Format role and name of a channel, cut and padded to `LABEL_COLUMNS` characters."""
    name = f"{channel.role} {channel.name}"
    return f"{name[: LABEL_COLUMNS - 1]:{LABEL_COLUMNS}}"
