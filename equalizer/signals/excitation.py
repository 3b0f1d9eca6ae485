"""Deterministic excitations as columns of samples: sinusoids, logarithmic sweeps, and fades at their ends.

Recordings for identification use sweeps, which excite a band, and sinusoids; stimuli use the fades. A signal has the
unit of its amplitude.
"""

import numpy as np

from equalizer.signals.signal import FloatArray


def sine(frequency_hz: float, amplitude: float, n: int, sample_rate_hz: float) -> FloatArray:
    """Sinusoid of n samples that starts at phase zero, (n,)."""
    wave: FloatArray = amplitude * np.sin(2 * np.pi * frequency_hz / sample_rate_hz * np.arange(n))
    return wave


def log_sweep(from_hz: float, to_hz: float, amplitude: float, n: int, sample_rate_hz: float) -> FloatArray:
    """A period of a logarithmic swept sine, (n,), which may be repeated without a jump. Every octave takes equal time.

    Frequency f(t) = from_hz (to_hz / from_hz)^(t / T), T = n / sample_rate_hz; all frequencies are lowered by a common
    factor, so that the period contains the next lower whole number of cycles. Raises ValueError where the sweep would
    not rise, would exceed half the sample rate, or would contain less than a cycle.
    """
    if not 0 < from_hz < to_hz <= sample_rate_hz / 2:
        raise ValueError(
            f"a sweep needs 0 < from_hz < to_hz <= {sample_rate_hz / 2:g} Hz (half the rate), "
            f"not {from_hz:g} to {to_hz:g}"
        )
    duration_s = n / sample_rate_hz
    log_ratio = np.log(to_hz / from_hz)
    cycles = from_hz * duration_s / log_ratio * (np.exp(log_ratio * np.arange(n) / n) - 1.0)
    total_cycles = from_hz * duration_s / log_ratio * (np.exp(log_ratio) - 1.0)
    if total_cycles < 1.0:
        raise ValueError(f"a sweep of {duration_s:g} s from {from_hz:g} to {to_hz:g} Hz holds less than a cycle")
    wave: FloatArray = amplitude * np.sin(2 * np.pi * cycles * np.floor(total_cycles) / total_cycles)
    return wave


def apply_fades(samples: FloatArray, fade_in: int, fade_out: int) -> FloatArray:
    """Samples (n, ...) with a raised-cosine rise over the first `fade_in` and fall over the last `fade_out` of them.
    Raises ValueError where both fades together are longer than the samples."""
    n = samples.shape[0]
    if fade_in + fade_out > n:
        raise ValueError(f"fades of {fade_in} and {fade_out} samples do not fit into {n}; shorten them")
    envelope = np.ones(n)
    envelope[:fade_in] = 0.5 - 0.5 * np.cos(np.pi * np.arange(fade_in) / max(fade_in, 1))
    envelope[n - fade_out :] = 0.5 + 0.5 * np.cos(np.pi * np.arange(1, fade_out + 1) / max(fade_out, 1))
    return samples * envelope.reshape((n,) + (1,) * (samples.ndim - 1))
