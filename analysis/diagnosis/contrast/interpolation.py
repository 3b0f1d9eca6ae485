"""Interpolation between samples by splines, and the factor by which it reduces one-step prediction errors.

Delays and deviating clock rates (`sensor_faults`) are undone by interpolation. Interpolation attenuates
high frequencies, and thereby reduces the prediction errors even where there is no such fault; the reduction that is
credited to a fault must not include this factor. By the Kolmogorov-Szegő formula the one-step prediction error variance
of a signal is the geometric mean of its spectrum over frequency, so that a filter multiplies prediction errors by the
geometric mean of its gain.
"""

from functools import cache

import numpy as np
from scipy.interpolate import make_interp_spline

from equalizer.signals.signal import FloatArray

SPLINE_DEGREE = 5
"""Degree of the splines. Chosen: splines do not ring at the ends of a signal, as a phase shift of its spectrum does,
and attenuate high frequencies far less than linear interpolation."""
DELAY_FRACTIONS = np.linspace(0.0, 1.0, 41)
"""Delays, in fractions of a sample, at which the factor is tabulated."""


def resample(samples: FloatArray, positions: FloatArray) -> FloatArray:
    """Interpolate the samples (n,), at least `SPLINE_DEGREE` + 1, at `positions` (k,), real-valued sample indices; the
    first and last sample are held beyond the ends. Raises ValueError where there are fewer samples."""
    spline = make_interp_spline(np.arange(len(samples)), samples, SPLINE_DEGREE)
    return np.asarray(spline(np.clip(positions, 0, len(samples) - 1)))


def shift_samples(samples: FloatArray, delay: float) -> FloatArray:
    """Delay the samples (n, k) by `delay` samples, a real number (negative = advance). Beyond both ends the signal is
    continued by point reflection (odd extension)."""
    margin = int(np.ceil(abs(delay))) + SPLINE_DEGREE
    padded = np.pad(samples, ((margin, margin), (0, 0)), mode="reflect", reflect_type="odd")
    spline = make_interp_spline(np.arange(-margin, len(samples) + margin), padded, SPLINE_DEGREE)
    return np.asarray(spline(np.arange(len(samples)) - delay))


def compute_noise_gain(positions: FloatArray | float) -> float:
    """Compute the factor, at most about 1, by which interpolation at `positions` (real-valued sample indices, at least
    one) multiplies one-step prediction errors: the geometric mean of its gain over frequency and over the positions."""
    return float(np.exp(np.mean(np.interp(np.mod(positions, 1.0), DELAY_FRACTIONS, _tabulate_log_gains()))))


@cache
def _tabulate_log_gains() -> FloatArray:
    """Tabulate the mean over frequency of the natural logarithm of the interpolation's gain, at each of
    `DELAY_FRACTIONS`: by FFT, zero-padded to 4096, of a delayed unit impulse in the middle of 401 samples, where the
    ends have no influence. Gains below 1e-6 count as 1e-6, because the gain at half the sample rate is zero for a delay
    of half a sample."""
    impulse = np.zeros((401, 1))
    impulse[200] = 1.0
    gains = [np.abs(np.fft.rfft(shift_samples(impulse, fraction)[:, 0], 4096)) for fraction in DELAY_FRACTIONS]
    return np.array([np.mean(np.log(np.maximum(gain, 1e-6))) for gain in gains])
