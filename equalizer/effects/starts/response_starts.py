"""Starting values of effects at the response: parameter values and time shifts of the predicted to the measured one.

A single parameter is found by grid search, a time shift by cross-correlation, refined by Gauss-Newton steps.
"""

from collections.abc import Callable, Sequence

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft

from equalizer.effects.effect import ALL_SITES
from equalizer.effects.simulation.interpolated_response import read_other_times
from equalizer.effects.starts.command_starts import best_on_grid
from equalizer.effects.starts.evidence import Evidence
from equalizer.signals.signal import FloatArray

LEAST_SHARE = 1e-3
"""Least share of the sum of squares by which a value must reduce it to become a starting value."""

NEARER = 3
"""Gauss-Newton steps that refine a time shift."""


def channels_of(evidence: Evidence, site: int) -> tuple[int, ...]:
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
    channels = list(channels_of(evidence, site))
    used, noise = evidence.used > 0, evidence.noise[channels]
    measured, predicted = evidence.response[:, channels], evidence.predicted[:, channels]

    def left(read: FloatArray) -> float:
        return float(np.sum((((measured - read) / noise) ** 2)[used]))

    best, misfit = best_on_grid(lambda value: left(change(predicted, value)), grid)
    return best if misfit < (1 - LEAST_SHARE) * left(predicted) else None


def axis_lateness(evidence: Evidence, axis: int, longest_s: float) -> float:
    """Time (s) by which the measured response to a driven axis lags the predicted one: in the axis's own channel where
    there are as many channels as axes, else over all channels. At most `longest_s` either way."""
    rate, own = evidence.sample_rate_hz, evidence.response.shape[1] == evidence.command.shape[1]
    channels = list(channels_of(evidence, axis if own else ALL_SITES))
    weight = evidence.used[:, None] / evidence.noise[channels]
    measured, predicted = evidence.response[:, channels] * weight, evidence.predicted[:, channels] * weight
    return lateness(measured, predicted, min(int(longest_s * rate), len(weight) // 2)) / rate


def starts_for_lateness(evidence: Evidence, axis: int, fitting: float | None, longest_s: float) -> tuple[float, ...]:
    """Delays or time constants in s to start from, the largest first: the response's time shift, and `fitting`, the
    value that fits the missing force. Neither is below a fifth of a sample, because re-tuned damping absorbs most of a
    small lag. Empty where the response is early by more than that."""
    late, least = axis_lateness(evidence, axis, longest_s), 0.2 / evidence.sample_rate_hz
    if late < -least:
        return ()
    return tuple(sorted({max(late, least), max(fitting or 0.0, least)}, reverse=True))


def shares_of(residual: FloatArray, basis: FloatArray, used: FloatArray) -> FloatArray:
    """(k,): least-squares coefficients of the residual (n,) on the columns of basis (n, k), where used (n,) > 0."""
    columns = basis[used > 0]
    size = np.maximum(np.linalg.norm(columns, axis=0), np.finfo(float).tiny)
    columns = columns / size
    # Few columns, scaled to length 1: the normal equations are accurate enough, and cost a tenth of a QR.
    found = np.linalg.lstsq(columns.T @ columns, columns.T @ residual[used > 0], rcond=None)[0]
    return np.asarray(found / size, dtype=np.float64)


def lateness(measured: FloatArray, predicted: FloatArray, longest: int) -> float:
    """Samples by which the measured response (n, p) lags the predicted one, from the peak of the normalised
    cross-correlation, summed over channels. At most `longest` either way; not refined at that limit."""
    longest = min(longest, len(measured) - 1)
    room = next_fast_len(len(measured) + longest, True)
    total: FloatArray = np.zeros(2 * longest + 1)
    for after, before in zip(measured.T, predicted.T, strict=True):
        size = float(np.linalg.norm(before) * np.linalg.norm(after))
        if size > 0:
            alike = irfft(rfft(after, room) * rfft(before, room).conj(), room)
            total = total + np.concatenate([alike[room - longest :], alike[: longest + 1]]) / size
    late = int(np.argmax(total)) - longest
    return float(late) if abs(late) == longest else _refine_lateness(measured, predicted, float(late))


def _refine_lateness(measured: FloatArray, predicted: FloatArray, late: float) -> float:
    """Time shift (samples) refined by Gauss-Newton steps to a fraction of a sample, without the bias of an interpolated
    correlation peak."""
    for _ in range(NEARER):
        shifted = read_other_times(predicted, 1.0, -late)
        slope = np.gradient(shifted, axis=0)
        size = float(np.sum(slope**2))
        if size == 0:
            break
        late -= float(np.clip(np.sum((measured - shifted) * slope) / size, -1.0, 1.0))
    return late
