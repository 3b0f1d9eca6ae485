"""Frequency response of a device from target to delivered acceleration, for the reproduction of the published figure 5.

T(f) is the ratio of the spectra of one steady period, line by line; column i belongs to a target along axis i. T is the
identity matrix for a perfect equalizer. `equalizer.tracking.feedforward.quality` defines flatness, coupling and axis
error.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from analysis.evaluation.reproduction.document import PlayedRow
from equalizer.signals.excitation import make_log_sweep
from equalizer.signals.multisine import list_lines_between, make_multisines
from equalizer.signals.signal import ComplexArray, FloatArray
from equalizer.tracking.feedforward.quality import measure_quality

SignalKind = Literal["sweep", "multisine"]


@dataclass(frozen=True, slots=True, eq=False)
class PlayedResponse:
    """Measured response from target to delivered acceleration, with the conditions of its measurement."""

    name: str
    """Name of the row in the document and figures."""
    device: str
    place_m: tuple[float, float, float]
    """Place of the handle in the workspace: x, y, z in m."""
    hand: bool
    signal: SignalKind
    frequency_hz: FloatArray
    """(lines,): frequencies of the spectral lines."""
    response: ComplexArray
    """(lines, axes, axes): T, delivered over target; the last index is the axis of the target."""
    peak_force_n: float
    """Largest magnitude of the commanded force vector, N."""
    clipped_ticks: int
    """Number of ticks of the device loop at which a cap cut the force."""
    multiply_adds: int | None = None
    """Multiply-adds per sample of the inverse that computes the forces; None where they are not counted."""


def make_target_wave(
    signal_kind: SignalKind, band_hz: tuple[float, float], period_samples: int, sample_rate_hz: float, seed: int
) -> FloatArray:
    """Make one period (period_samples,) of the target signal, with a peak of 1 and without power outside the band.
    seed: of the multisine's phases; a sweep has none."""
    low_hz, high_hz = band_hz
    if signal_kind == "multisine":
        lines = list_lines_between(low_hz, high_hz, period_samples, sample_rate_hz, odd_only=False)
        return make_multisines(lines, period_samples, 1.0, 1, 1, seed)[0][:, 0]
    # Slightly wider than the band (factors chosen by hand), so that its ends lie inside the sweep, not at its jump.
    spectrum = np.fft.rfft(make_log_sweep(0.9 * low_hz, 1.06 * high_hz, 1.0, period_samples, sample_rate_hz))
    spectrum[~mask_lines_in_band(band_hz, period_samples, sample_rate_hz)] = 0
    wave = np.fft.irfft(spectrum, period_samples)
    normalised: FloatArray = wave / np.abs(wave).max()
    return normalised


def mask_lines_in_band(
    band_hz: tuple[float, float], period_samples: int, sample_rate_hz: float
) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """Make the mask (period_samples // 2 + 1,) of the lines of a period's real FFT that lie within the band, ends
    included, with a tolerance of 1e-9 Hz for rounding."""
    frequency_hz = np.fft.rfftfreq(period_samples, 1 / sample_rate_hz)
    return np.asarray((frequency_hz >= band_hz[0] - 1e-9) & (frequency_hz <= band_hz[1] + 1e-9))


def estimate_response(
    target: FloatArray, delivered: Sequence[FloatArray], band_hz: tuple[float, float], sample_rate_hz: float
) -> tuple[FloatArray, ComplexArray]:
    """Estimate frequencies in Hz (lines,) and response (lines, axes, axes), delivered over target. target: (axes,
    period_samples), the signal of each axis, played one axis at a time. delivered: for each of these, one steady period
    (period_samples, axes)."""
    period_samples = target.shape[1]
    is_in_band = mask_lines_in_band(band_hz, period_samples, sample_rate_hz)
    columns = [
        np.fft.rfft(delivered_period, axis=0)[is_in_band] / np.fft.rfft(wave)[is_in_band][:, None]
        for wave, delivered_period in zip(target, delivered, strict=True)
    ]
    frequency_hz = np.asarray(np.fft.rfftfreq(period_samples, 1 / sample_rate_hz)[is_in_band], dtype=np.float64)
    return frequency_hz, np.stack(columns, axis=2)


def normalise_gain(response: ComplexArray) -> ComplexArray:
    """Divide the response by the geometric mean of its diagonal gains over all lines and axes: the deviation from 1 of
    this mean could be corrected by a static gain."""
    diagonal = np.abs(np.einsum("lii->li", response))
    normalised: ComplexArray = response / np.exp(np.log(diagonal).mean())
    return normalised


def compute_coupling_db(response: ComplexArray) -> FloatArray:
    """Compute the coupling in dB (lines,): the largest |T_ji| / |T_ii| with j != i, over all target axes i; at least
    -240 dB (1e-12), so that the logarithm of 0 is finite."""
    diagonal = np.abs(np.einsum("lii->li", response))
    off_diagonal = np.abs(response) * (1 - np.eye(response.shape[1]))
    coupling_db: FloatArray = 20 * np.log10(np.maximum((off_diagonal.max(axis=1) / diagonal).max(axis=1), 1e-12))
    return coupling_db


def make_played_row(playback: PlayedResponse) -> PlayedRow:
    """Make a row of the document from the response's figures of merit. Its `error` is the rms over lines of the
    Frobenius norm of T - I, divided by the root of the number of axes."""
    quality = measure_quality(playback.response)
    axis_count = playback.response.shape[1]
    error = np.sqrt((np.abs(playback.response - np.eye(axis_count)) ** 2).sum() / (axis_count * len(playback.response)))
    x_mm, y_mm, z_mm = (1000 * coordinate_m for coordinate_m in playback.place_m)
    return PlayedRow(
        name=playback.name,
        device=playback.device,
        place_mm=(x_mm, y_mm, z_mm),
        hand=playback.hand,
        signal=playback.signal,
        flatness_db=quality.flatness_db,
        coupling_db=max(quality.coupling_db, -240.0),
        median_coupling_db=float(np.median(compute_coupling_db(playback.response))),
        axis_error_deg=quality.axis_error_deg,
        error=float(error),
        peak_force_n=playback.peak_force_n,
        clipped_ticks=playback.clipped_ticks,
        multiply_adds=playback.multiply_adds,
    )
