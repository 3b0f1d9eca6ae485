"""Draw the channels of a recording with braille characters: time series and amplitude spectra.

Each channel takes two lines of text, so that a recording can be judged in a terminal before any plot is made.
"""

import itertools
from collections.abc import Iterable

import numpy as np

from analysis.look.channels import Channel, format_value
from analysis.look.overview import Overview
from equalizer.signals.signal import FloatArray
from study.tui.drawing.braille import Canvas

LABEL, COLUMNS, ROWS = 24, 54, 2
"""Width of the label, and width and height of the drawing, in characters."""
_DECADES = 4.0
"""Range of amplitudes that a spectrum shows, in decades below its maximum."""


def time_series_lines(channel: Channel) -> Iterable[str]:
    """Draw a channel over time: each column of dots spans the lowest to the highest of its samples. The extremes of the
    whole channel are written at the right, with their unit. Missing samples leave gaps."""
    finite_samples = channel.finite_samples
    if not finite_samples.size:
        yield f"{_channel_label(channel)} {'':{COLUMNS}} no samples"
        return
    canvas = Canvas(COLUMNS, ROWS)
    low, high = float(finite_samples.min()), float(finite_samples.max())
    span = high - low or 1.0
    for x, (bottom, top) in enumerate(_columns(channel.samples, canvas.width)):
        if np.isfinite(bottom):
            from_y, to_y = (round((high - value) / span * (canvas.height - 1)) for value in (top, bottom))
            canvas.line((x, from_y), (x, to_y))
    first, last = canvas.lines()
    yield f"{_channel_label(channel)} {first:{COLUMNS}} {format_value(high, channel.unit)}".rstrip()
    yield f"{'':{LABEL}} {last:{COLUMNS}} {format_value(low, channel.unit)}".rstrip()


def _columns(samples: FloatArray, columns: int) -> list[tuple[float, float]]:
    """Lowest and highest finite sample in each of `columns` equal parts of the channel; NaN for a part without one."""
    edges = np.linspace(0, len(samples), columns + 1).astype(int)
    ranges = []
    for start, stop in itertools.pairwise(edges):
        part = samples[start : max(stop, start + 1)]
        part = part[np.isfinite(part)]
        ranges.append((float(part.min()), float(part.max())) if part.size else (np.nan, np.nan))
    return ranges


def spectrum_lines(overview: Overview) -> Iterable[str]:
    """Draw the amplitude spectral densities of command and response channels, the square roots of their power spectral
    densities, both axes logarithmic. Nothing is drawn without spectra; channels without power are left out."""
    if overview.spectra is None:
        return
    frequency_hz = overview.spectra.frequency_hz
    for k, channel in enumerate(overview.channels):
        power = overview.spectra.power(k)
        if channel.role not in ("command", "response") or power.max() <= 0:
            continue
        canvas = Canvas(COLUMNS, ROWS)
        edges = np.geomspace(frequency_hz[0], frequency_hz[-1] * 1.001, canvas.width + 1)
        for x, (start, stop) in enumerate(itertools.pairwise(edges)):
            # The largest line within the column; where low frequencies have none, interpolate between lines.
            column_power = power[(frequency_hz >= start) & (frequency_hz < stop)]
            size = float(column_power.max()) if column_power.size else float(np.interp(start, frequency_hz, power))
            # Distance below the maximum over the range; 0.5 log10 of a power ratio is log10 of the amplitude ratio.
            depth = -0.5 * np.log10(max(size / power.max(), 1e-99)) / _DECADES
            if depth <= 1:
                canvas.line((x, round(depth * (canvas.height - 1))), (x, canvas.height - 1))
        first, last = canvas.lines()
        yield f"{_channel_label(channel)} {first:{COLUMNS}} amplitude, {_DECADES:g} decades"
        span = f"{frequency_hz[0]:.3g} to {frequency_hz[-1]:.4g} Hz"
        yield f"{'':{LABEL}} {last:{COLUMNS}} {span}"


def _channel_label(channel: Channel) -> str:
    """Role and name of a channel, cut and padded to `LABEL` characters."""
    name = f"{channel.role} {channel.name}"
    return f"{name[: LABEL - 1]:{LABEL}}"
