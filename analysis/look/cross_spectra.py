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

_TARGET_WINDOW_COUNT = 12
"""Number of half-overlapping windows to aim for. The estimated coherence of unrelated signals averages 1 / n for n
independent windows, so coherences near 0.1 mean little here."""
_SHORTEST_WINDOW_SAMPLES, _LONGEST_WINDOW_SAMPLES = 32, 8192
"""Shortest and longest window, samples. Chosen: shorter ones resolve hardly any frequency; the longest bounds the
memory."""
LARGEST_WINDOW_COUNT = 400
"""Largest number of windows that are averaged, spread over the recording: more take time without benefit. Chosen: the
coherence of unrelated signals is then below 1 %."""


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

    def get_power_density(self, channel_index: int) -> FloatArray:
        """Return the power spectral density (lines,) of a channel, in its unit² / Hz."""
        density: FloatArray = self.matrix[:, channel_index, channel_index].real
        return density

    def compute_coherence(self, first_index: int, second_index: int) -> FloatArray:
        """Compute the magnitude-squared coherence (lines,) of two channels, 0 to 1; 0 where either has no power."""
        amplitude_product = np.sqrt(self.get_power_density(first_index)) * np.sqrt(self.get_power_density(second_index))
        return np.asarray(
            (
                np.abs(self.matrix[:, first_index, second_index])
                / np.where(amplitude_product > 0, amplitude_product, np.inf)
            )
            ** 2
        )


def estimate_cross_spectra(
    channels: Sequence[Channel], stretches: Sequence[Stretch], rate_hz: float, samples_per_window: int = 0
) -> CrossSpectra | None:
    """Estimate the cross-spectral densities of the channels; None where no window is complete: too short a record, or
    missing samples in every window. stretches: (start, stop) of parts without gaps, at least one. rate_hz: sample
    rate. samples_per_window: 0 = chosen by the length of the recording."""
    channel_samples = np.column_stack([channel.samples for channel in channels])
    sample_count = sum(stop - start for start, stop in stretches)
    target_samples = 2 ** int(np.log2(max(2 * sample_count / _TARGET_WINDOW_COUNT, _SHORTEST_WINDOW_SAMPLES)))
    window_samples = min(
        samples_per_window or min(target_samples, _LONGEST_WINDOW_SAMPLES),
        max(stop - start for start, stop in stretches),
    )
    window_samples -= window_samples % 2  # even, so that the last line is at the Nyquist frequency
    if window_samples < _SHORTEST_WINDOW_SAMPLES:
        return None
    window_starts = [
        first
        for start, stop in stretches
        for first in range(start, stop - window_samples + 1, max(1, window_samples // 2))
    ]
    complete_starts = [
        first for first in window_starts if np.isfinite(channel_samples[first : first + window_samples]).all()
    ]
    used_starts = complete_starts[:: max(1, -(-len(complete_starts) // LARGEST_WINDOW_COUNT))]
    if not used_starts:
        return None
    hann_window, line_basis = np.hanning(window_samples + 1)[:-1], _make_line_basis(window_samples)
    product_sums = np.zeros((window_samples // 2, len(channels), len(channels)), dtype=np.complex128)
    for first in used_starts:
        segment = channel_samples[first : first + window_samples]
        segment = segment - line_basis @ (line_basis.T @ segment)
        spectra = np.fft.rfft(segment * hann_window[:, None], axis=0)[1 : window_samples // 2 + 1]
        product_sums += np.einsum("li,lj->lij", spectra.conj(), spectra)
    product_sums[-1] /= 2  # the line at the Nyquist frequency has no counterpart at a negative frequency
    scale = 2.0 / (rate_hz * float(np.sum(hann_window**2)) * len(used_starts))
    frequency_hz = np.arange(1, window_samples // 2 + 1) * (rate_hz / window_samples)
    return CrossSpectra(
        frequency_hz,
        np.asarray(product_sums * scale, dtype=np.complex128),
        len(used_starts),
        tuple(channel.label for channel in channels),
    )


def _make_line_basis(length: int) -> npt.NDArray[np.float64]:
    """Make an orthonormal basis (length, 2) of the straight lines; length in samples."""
    ramp = np.arange(length) - (length - 1) / 2
    return np.column_stack([np.full(length, length**-0.5), ramp / np.sqrt(ramp @ ramp)])
