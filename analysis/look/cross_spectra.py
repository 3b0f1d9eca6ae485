"""One-sided power and cross spectral densities of all channels by Welch's method: averages over Hann windows.

Windows overlap by half; a straight line is subtracted from each. No window spans two stretches of a recording or
contains a missing sample, so gaps do not leak into the spectra.

Reference: Welch, IEEE Transactions on Audio and Electroacoustics 15 (1967), 70-73.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from analysis.look.channels import Channel, Stretch
from equalizer.signals.signal import ComplexArray, FloatArray

_WINDOWS = 12
"""Number of half-overlapping windows to aim for. The estimated coherence of unrelated signals averages 1 / n for n
independent windows, so coherences near 0.1 mean little here."""
_SHORTEST, _LONGEST = 32, 8192
"""Shortest and longest window, samples."""
MOST_WINDOWS = 400
"""Largest number of windows that are averaged, spread over the recording: more take time without benefit."""


@dataclass(frozen=True, slots=True, eq=False)
class CrossSpectra:
    """Power and cross spectral densities of all channels, averaged over windows."""

    frequency_hz: FloatArray
    """(lines,), ascending, without the line at 0 Hz."""
    matrix: ComplexArray
    """(lines, channels, channels), one-sided densities in unit x unit / Hz; [:, i, j] is the mean of conj(X_i) X_j."""
    windows: int
    """Number of windows averaged."""
    columns: tuple[str, ...]
    """Labels of the channels."""

    def power(self, channel: int) -> FloatArray:
        """(lines,): power spectral density of a channel, in its unit² / Hz. channel: its index."""
        density: FloatArray = self.matrix[:, channel, channel].real
        return density

    def coherence(self, first: int, second: int) -> FloatArray:
        """(lines,): magnitude-squared coherence of two channels, 0 to 1; 0 where either has no power."""
        amplitude_product = np.sqrt(self.power(first)) * np.sqrt(self.power(second))
        return np.asarray(
            (np.abs(self.matrix[:, first, second]) / np.where(amplitude_product > 0, amplitude_product, np.inf)) ** 2
        )


def cross_spectra(
    channels: Sequence[Channel], stretches: Sequence[Stretch], rate_hz: float, samples_per_window: int = 0
) -> CrossSpectra | None:
    """Cross-spectral densities of the channels; None where no window is whole. stretches: at least one. rate_hz: sample
    rate. samples_per_window: 0: chosen by the length of the recording."""
    columns = np.column_stack([channel.samples for channel in channels])
    sample_count = sum(stop - start for start, stop in stretches)
    target_length = 2 ** int(np.log2(max(2 * sample_count / _WINDOWS, _SHORTEST)))
    length = min(samples_per_window or min(target_length, _LONGEST), max(stop - start for start, stop in stretches))
    length -= length % 2  # even, so that the last line is at the Nyquist frequency
    if length < _SHORTEST:
        return None
    window_starts = [
        window_start
        for start, stop in stretches
        for window_start in range(start, stop - length + 1, max(1, length // 2))
    ]
    complete_starts = [
        window_start
        for window_start in window_starts
        if np.isfinite(columns[window_start : window_start + length]).all()
    ]
    used_starts = complete_starts[:: max(1, -(-len(complete_starts) // MOST_WINDOWS))]
    if not used_starts:
        return None
    window, line_basis = np.hanning(length + 1)[:-1], _straight_lines(length)
    product_sums = np.zeros((length // 2, len(channels), len(channels)), dtype=np.complex128)
    for window_start in used_starts:
        detrended = columns[window_start : window_start + length]
        detrended = detrended - line_basis @ (line_basis.T @ detrended)
        lines = np.fft.rfft(detrended * window[:, None], axis=0)[1 : length // 2 + 1]
        product_sums += np.einsum("li,lj->lij", lines.conj(), lines)
    product_sums[-1] /= 2  # the line at the Nyquist frequency stands for itself alone
    scale = 2.0 / (rate_hz * float(np.sum(window**2)) * len(used_starts))
    frequency_hz = np.arange(1, length // 2 + 1) * (rate_hz / length)
    return CrossSpectra(
        frequency_hz,
        np.asarray(product_sums * scale, dtype=np.complex128),
        len(used_starts),
        tuple(channel.label for channel in channels),
    )


def _straight_lines(length: int) -> npt.NDArray[np.float64]:
    """(length, 2): orthonormal basis of the straight lines that are subtracted from each window."""
    ramp = np.arange(length) - (length - 1) / 2
    return np.column_stack([np.full(length, length**-0.5), ramp / np.sqrt(ramp @ ramp)])
