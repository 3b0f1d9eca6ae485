"""Starting values of effects at the response: a parameter, or the time shift from predicted to measured response.

A single parameter is found by grid search, a time shift by cross-correlation, refined by Gauss-Newton steps. Called by
the effects at the response, by the delays and lags of the actuator, and by `analysis.diagnosis.contrast.likely_delays`.
"""

from collections.abc import Callable, Sequence

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft

from equalizer.effects.effect import ALL_SITES
from equalizer.effects.simulation.interpolated_response import resample_response
from equalizer.effects.starts.command_starts import minimise_on_grid
from equalizer.effects.starts.evidence import Evidence
from equalizer.signals.signal import FloatArray

LEAST_IMPROVEMENT = 1e-3
"""Least relative reduction of the sum of squares for a value to become a starting value. Chosen."""

REFINEMENT_STEPS = 3
"""Number of Gauss-Newton steps that refine a time shift. Chosen."""


def list_site_channels(evidence: Evidence, site: int) -> tuple[int, ...]:
    """List the columns of the response at which an effect acts: all for ALL_SITES, else that of the site."""
    return tuple(range(evidence.response.shape[1])) if site == ALL_SITES else (site,)


def find_response_parameter(
    evidence: Evidence,
    site: int,
    change: Callable[[FloatArray, float], FloatArray],
    grid: Sequence[float],
) -> float | None:
    """Find the parameter value that brings the predicted response closest to the measured one, in units of the noise:
    grid search, refined by golden section. change: maps samples (n, channels) and a value to changed samples. grid:
    positive values in ascending order, at least one. None where no value improves the fit by `LEAST_IMPROVEMENT`."""
    channels = list(list_site_channels(evidence, site))
    is_used, noise = evidence.used > 0, evidence.noise[channels]
    measured, predicted = evidence.response[:, channels], evidence.predicted[:, channels]

    def compute_misfit(changed_response: FloatArray) -> float:
        """Compute the sum of squares of the residual over the noise."""
        return float(np.sum((((measured - changed_response) / noise) ** 2)[is_used]))

    best_value, misfit = minimise_on_grid(lambda value: compute_misfit(change(predicted, value)), grid)
    return best_value if misfit < (1 - LEAST_IMPROVEMENT) * compute_misfit(predicted) else None


def estimate_axis_lag(evidence: Evidence, axis: int, largest_lag_s: float) -> float:
    """Estimate the time (s) by which the measured response to a driven axis lags the predicted one: in the axis's own
    channel where there are as many channels as axes, else over all channels. Sought up to `largest_lag_s`, or half of
    the recording, either way."""
    sample_rate_hz, has_own_channel = evidence.sample_rate_hz, evidence.response.shape[1] == evidence.command.shape[1]
    channels = list(list_site_channels(evidence, axis if has_own_channel else ALL_SITES))
    weight = evidence.used[:, None] / evidence.noise[channels]
    measured, predicted = evidence.response[:, channels] * weight, evidence.predicted[:, channels] * weight
    return (
        estimate_lag(measured, predicted, min(int(largest_lag_s * sample_rate_hz), len(weight) // 2)) / sample_rate_hz
    )


def list_lag_starts(
    evidence: Evidence, axis: int, force_lag_s: float | None, largest_lag_s: float
) -> tuple[float, ...]:
    """List delays or time constants (s) to start from, the largest first: the response's time shift, and `force_lag_s`,
    the value that fits the missing force (None: unknown). Neither is below a fifth of a sample, because re-tuned
    damping absorbs most of a small lag. Empty where the response is early by more than that."""
    lag_s, least_lag_s = estimate_axis_lag(evidence, axis, largest_lag_s), 0.2 / evidence.sample_rate_hz
    if lag_s < -least_lag_s:
        return ()
    return tuple(sorted({max(lag_s, least_lag_s), max(force_lag_s or 0.0, least_lag_s)}, reverse=True))


def fit_coefficients(residual: FloatArray, basis: FloatArray, used: FloatArray) -> FloatArray:
    """Fit the coefficients (k,) of the columns of basis (n, k) to the residual (n,) by least squares, where used (n,) >
    0."""
    columns = basis[used > 0]
    column_norms = np.maximum(np.linalg.norm(columns, axis=0), np.finfo(float).tiny)
    columns = columns / column_norms
    # Few columns, scaled to length 1: the normal equations are accurate enough, and cost a tenth of a QR.
    coefficients = np.linalg.lstsq(columns.T @ columns, columns.T @ residual[used > 0], rcond=None)[0]
    return np.asarray(coefficients / column_norms, dtype=np.float64)


def estimate_lag(measured: FloatArray, predicted: FloatArray, largest_lag_samples: int) -> float:
    """Estimate the number of samples by which the measured response (n, p) lags the predicted one, from the peak of the
    normalised cross-correlation, summed over channels, up to `largest_lag_samples` either way; refined unless the peak
    is at that limit, which the refinement may exceed by less than `REFINEMENT_STEPS` samples."""
    largest_lag_samples = min(largest_lag_samples, len(measured) - 1)
    padded_length = next_fast_len(len(measured) + largest_lag_samples, True)
    correlation_sum: FloatArray = np.zeros(2 * largest_lag_samples + 1)
    for measured_channel, predicted_channel in zip(measured.T, predicted.T, strict=True):
        norm_product = float(np.linalg.norm(predicted_channel) * np.linalg.norm(measured_channel))
        if norm_product > 0:
            correlation = irfft(
                rfft(measured_channel, padded_length) * rfft(predicted_channel, padded_length).conj(), padded_length
            )
            correlation_sum = (
                correlation_sum
                + np.concatenate(
                    [correlation[padded_length - largest_lag_samples :], correlation[: largest_lag_samples + 1]]
                )
                / norm_product
            )
    lag = int(np.argmax(correlation_sum)) - largest_lag_samples
    return float(lag) if abs(lag) == largest_lag_samples else _refine_lag(measured, predicted, float(lag))


def _refine_lag(measured: FloatArray, predicted: FloatArray, lag_samples: float) -> float:
    """Refine a time shift (samples) by Gauss-Newton steps, of at most one sample each, to a fraction of a sample,
    without the bias of an interpolated correlation peak."""
    for _ in range(REFINEMENT_STEPS):
        shifted = resample_response(predicted, 1.0, -lag_samples)
        slope = np.gradient(shifted, axis=0)
        slope_power = float(np.sum(slope**2))
        if slope_power == 0:
            break
        lag_samples -= float(np.clip(np.sum((measured - shifted) * slope) / slope_power, -1.0, 1.0))
    return lag_samples
