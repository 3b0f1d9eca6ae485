"""Interpolation between samples by splines, and the factor by which it reduces one-step prediction errors.

By Kolmogorov's formula the one-step prediction error variance of a signal is the geometric mean of its spectrum over
frequency, so that a filter multiplies prediction errors by the geometric mean of its gain. Delays and clock rates are
undone by interpolation (`sensor_faults`), and their gain must not include this factor.
"""

from functools import cache

import numpy as np
from scipy.interpolate import make_interp_spline

from equalizer.signals.signal import FloatArray

SPLINE_DEGREE = 5
"""Degree of the splines. They act locally, whereas a phase shift of the spectrum rings at the ends of a signal, and
attenuate high frequencies far less than linear interpolation."""
FRACTIONS = np.linspace(0.0, 1.0, 41)
"""Fractions of a sample at which the factor is tabulated."""


def resample(samples: FloatArray, times: FloatArray) -> FloatArray:
    """Samples (n,) interpolated at times `times` (n,), in samples; held beyond the ends."""
    spline = make_interp_spline(np.arange(len(samples)), samples, SPLINE_DEGREE)
    return np.asarray(spline(np.clip(times, 0, len(samples) - 1)))


def shift_samples(samples: FloatArray, delay: float) -> FloatArray:
    """Samples (n, k) delayed by `delay` samples, a real number; continued beyond both ends as an odd function."""
    margin = int(np.ceil(abs(delay))) + SPLINE_DEGREE
    padded = np.pad(samples, ((margin, margin), (0, 0)), mode="reflect", reflect_type="odd")
    spline = make_interp_spline(np.arange(-margin, len(samples) + margin), padded, SPLINE_DEGREE)
    return np.asarray(spline(np.arange(len(samples)) - delay))


def noise_gain(times: FloatArray | float) -> float:
    """Factor (at most about 1) by which interpolation at `times`, in samples, multiplies one-step prediction errors:
    the geometric mean of its gain over frequency (Kolmogorov's formula) and over the times."""
    return float(np.exp(np.mean(np.interp(np.mod(times, 1.0), FRACTIONS, _log_gains()))))


@cache
def _log_gains() -> FloatArray:
    """Mean logarithm of the interpolation's gain over frequency, at each of `FRACTIONS`."""
    impulse = np.zeros((401, 1))
    impulse[200] = 1.0
    gains = [np.abs(np.fft.rfft(shift_samples(impulse, fraction)[:, 0], 4096)) for fraction in FRACTIONS]
    return np.array([np.mean(np.log(np.maximum(gain, 1e-6))) for gain in gains])
