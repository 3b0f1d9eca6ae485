"""Starting values of effects at the response: parameter values and time shifts of the predicted to the measured one.

A single parameter is found by grid search, a time shift by cross-correlation, refined by Gauss-Newton steps.
"""

from collections.abc import Callable, Sequence

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft

from equalizer.effects.effect import ALL_SITES
from equalizer.effects.simulation.interpolated_response import resample_response
from equalizer.effects.starts.command_starts import best_on_grid
from equalizer.effects.starts.evidence import Evidence
from equalizer.signals.signal import FloatArray

LEAST_SHARE = 1e-3
"""Least share of the sum of squares by which a value must reduce it to become a starting value."""

REFINEMENTS = 3
"""Gauss-Newton steps that refine a time shift."""


def site_channels(evidence: Evidence, site: int) -> tuple[int, ...]:
    """Columns of the response at which an effect acts: all for ALL_SITES, else that of the site."""
    return tuple(range(evidence.response.shape[1])) if site == ALL_SITES else (site,)


def likeliest_reading(
    evidence: Evidence,
    site: int,
    change: Callable[[FloatArray, float], FloatArray],
    grid: Sequence[float],
) -> float | None:
    """The parameter value that brings the predicted response closest to the measured one, in units of the noise: grid
    search, refined by golden section. change: maps samples (n, channels) and a value to changed samples. grid: positive
    values in ascending order. None where no value improves the fit."""
    channels = list(site_channels(evidence, site))
    used, noise = evidence.used > 0, evidence.noise[channels]
    measured, predicted = evidence.response[:, channels], evidence.predicted[:, channels]

    def misfit_of(read: FloatArray) -> float:
        return float(np.sum((((measured - read) / noise) ** 2)[used]))

    best, misfit = best_on_grid(lambda value: misfit_of(change(predicted, value)), grid)
    return best if misfit < (1 - LEAST_SHARE) * misfit_of(predicted) else None


def axis_lateness(evidence: Evidence, axis: int, longest_s: float) -> float:
    """Time (s) by which the measured response to a driven axis lags the predicted one: in the axis's own channel where
    there are as many channels as axes, else over all channels. At most `longest_s` either way."""
    rate, has_own_channel = evidence.sample_rate_hz, evidence.response.shape[1] == evidence.command.shape[1]
    channels = list(site_channels(evidence, axis if has_own_channel else ALL_SITES))
    weight = evidence.used[:, None] / evidence.noise[channels]
    measured, predicted = evidence.response[:, channels] * weight, evidence.predicted[:, channels] * weight
    return lateness(measured, predicted, min(int(longest_s * rate), len(weight) // 2)) / rate


def starts_for_lateness(
    evidence: Evidence, axis: int, force_lag_s: float | None, longest_s: float
) -> tuple[float, ...]:
    """Delays or time constants in s to start from, the largest first: the response's time shift, and `force_lag_s`, the
    value that fits the missing force. Neither is below a fifth of a sample, because re-tuned damping absorbs most of a
    small lag. Empty where the response is early by more than that."""
    lag_s, least_lag_s = axis_lateness(evidence, axis, longest_s), 0.2 / evidence.sample_rate_hz
    if lag_s < -least_lag_s:
        return ()
    return tuple(sorted({max(lag_s, least_lag_s), max(force_lag_s or 0.0, least_lag_s)}, reverse=True))


def regression_coefficients(residual: FloatArray, basis: FloatArray, used: FloatArray) -> FloatArray:
    """(k,): least-squares coefficients of the residual (n,) on the columns of basis (n, k), where used (n,) > 0."""
    columns = basis[used > 0]
    size = np.maximum(np.linalg.norm(columns, axis=0), np.finfo(float).tiny)
    columns = columns / size
    # Few columns, scaled to length 1: the normal equations are accurate enough, and cost a tenth of a QR.
    coefficients = np.linalg.lstsq(columns.T @ columns, columns.T @ residual[used > 0], rcond=None)[0]
    return np.asarray(coefficients / size, dtype=np.float64)


def lateness(measured: FloatArray, predicted: FloatArray, longest: int) -> float:
    """Samples by which the measured response (n, p) lags the predicted one, from the peak of the normalised
    cross-correlation, summed over channels. At most `longest` either way; not refined at that limit."""
    longest = min(longest, len(measured) - 1)
    padded_length = next_fast_len(len(measured) + longest, True)
    total: FloatArray = np.zeros(2 * longest + 1)
    for measured_channel, predicted_channel in zip(measured.T, predicted.T, strict=True):
        size = float(np.linalg.norm(predicted_channel) * np.linalg.norm(measured_channel))
        if size > 0:
            correlation = irfft(
                rfft(measured_channel, padded_length) * rfft(predicted_channel, padded_length).conj(), padded_length
            )
            total = total + np.concatenate([correlation[padded_length - longest :], correlation[: longest + 1]]) / size
    lag = int(np.argmax(total)) - longest
    return float(lag) if abs(lag) == longest else _refine_lateness(measured, predicted, float(lag))


def _refine_lateness(measured: FloatArray, predicted: FloatArray, lag: float) -> float:
    """Time shift (samples) refined by Gauss-Newton steps to a fraction of a sample, without the bias of an interpolated
    correlation peak."""
    for _ in range(REFINEMENTS):
        shifted = resample_response(predicted, 1.0, -lag)
        slope = np.gradient(shifted, axis=0)
        size = float(np.sum(slope**2))
        if size == 0:
            break
        lag -= float(np.clip(np.sum((measured - shifted) * slope) / size, -1.0, 1.0))
    return lag
