"""Excitations that identification and ellipsoids need, as plain columns of samples."""

import numpy as np

from equalizer.signals.signal import FloatArray


def sine(frequency_hz: float, amplitude: float, n: int, sample_rate_hz: float) -> FloatArray:
    """n samples of a sinusoid that starts at phase zero. Shape (n,)."""
    wave: FloatArray = amplitude * np.sin(2 * np.pi * frequency_hz / sample_rate_hz * np.arange(n))
    return wave


def log_sweep(from_hz: float, to_hz: float, amplitude: float, n: int, sample_rate_hz: float) -> FloatArray:
    """One period of a logarithmic swept sine, shape (n,), which may be repeated without a jump.

    Equal time per octave. The end frequency is lowered by less than 1 / duration, so that the period holds a whole
    number of cycles. Raises ValueError where the sweep would not be upwards, would pass half the rate, or would hold
    less than a cycle.
    """
    if not 0 < from_hz < to_hz <= sample_rate_hz / 2:
        raise ValueError(
            f"a sweep needs 0 < from_hz < to_hz <= {sample_rate_hz / 2:g} Hz (half the rate), "
            f"not {from_hz:g} to {to_hz:g}"
        )
    duration_s = n / sample_rate_hz
    log_ratio = np.log(to_hz / from_hz)
    cycles = from_hz * duration_s / log_ratio * (np.exp(log_ratio * np.arange(n) / n) - 1.0)
    whole = from_hz * duration_s / log_ratio * (np.exp(log_ratio) - 1.0)
    if whole < 1.0:
        raise ValueError(f"a sweep of {duration_s:g} s from {from_hz:g} to {to_hz:g} Hz holds less than a cycle")
    wave: FloatArray = amplitude * np.sin(2 * np.pi * cycles * np.floor(whole) / whole)
    return wave


def apply_fades(samples: FloatArray, fade_in: int, fade_out: int) -> FloatArray:
    """Raised-cosine rise over the first `fade_in` and fall over the last `fade_out` samples. samples: (n, ...)."""
    n = samples.shape[0]
    if fade_in + fade_out > n:
        raise ValueError(f"fades of {fade_in} and {fade_out} samples do not fit into {n}; shorten them")
    envelope = np.ones(n)
    envelope[:fade_in] = 0.5 - 0.5 * np.cos(np.pi * np.arange(fade_in) / max(fade_in, 1))
    envelope[n - fade_out :] = 0.5 + 0.5 * np.cos(np.pi * np.arange(1, fade_out + 1) / max(fade_out, 1))
    return samples * envelope.reshape((n,) + (1,) * (samples.ndim - 1))
