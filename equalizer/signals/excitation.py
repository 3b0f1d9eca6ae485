"""Deterministic excitation signals for system identification: sinusoids, logarithmic swept sines, and fades.

Called by `study.session.stimulus` for recordings and probes, by the design of experiments
(`analysis.diagnosis.next_experiment`), and by the evaluation of playback. A signal has the unit of its amplitude.
"""

import numpy as np

from equalizer.signals.signal import FloatArray


def make_sine(frequency_hz: float, amplitude: float, sample_count: int, sample_rate_hz: float) -> FloatArray:
    """Make a sinusoid that starts at phase zero, (sample_count,)."""
    wave: FloatArray = amplitude * np.sin(2 * np.pi * frequency_hz / sample_rate_hz * np.arange(sample_count))
    return wave


def make_log_sweep(
    from_hz: float, to_hz: float, amplitude: float, sample_count: int, sample_rate_hz: float
) -> FloatArray:
    """Make one period of a logarithmic swept sine, (sample_count,), which can be repeated without a jump of phase.

    Frequency f(t) = from_hz (to_hz / from_hz)^(t / T), T = sample_count / sample_rate_hz; all frequencies are lowered
    by a common factor, so that the period contains the next lower whole number of cycles. Raises ValueError unless 0 <
    from_hz < to_hz <= half the sample rate, and where the period would contain less than a cycle.
    """
    if not 0 < from_hz < to_hz <= sample_rate_hz / 2:
        raise ValueError(
            f"a sweep needs 0 < from_hz < to_hz <= {sample_rate_hz / 2:g} Hz (half the rate), "
            f"not {from_hz:g} to {to_hz:g}"
        )
    duration_s = sample_count / sample_rate_hz
    log_ratio = np.log(to_hz / from_hz)
    phase_cycles = from_hz * duration_s / log_ratio * (np.exp(log_ratio * np.arange(sample_count) / sample_count) - 1.0)
    total_cycles = from_hz * duration_s / log_ratio * (np.exp(log_ratio) - 1.0)
    if total_cycles < 1.0:
        raise ValueError(f"a sweep of {duration_s:g} s from {from_hz:g} to {to_hz:g} Hz holds less than a cycle")
    wave: FloatArray = amplitude * np.sin(2 * np.pi * phase_cycles * np.floor(total_cycles) / total_cycles)
    return wave


def apply_fades(samples: FloatArray, fade_in_samples: int, fade_out_samples: int) -> FloatArray:
    """Apply a raised-cosine rise to the first `fade_in_samples` and a fall to the last `fade_out_samples` of the
    samples (n, ...), from and to zero. Raises ValueError where both fades together are longer than the samples."""
    sample_count = samples.shape[0]
    if fade_in_samples + fade_out_samples > sample_count:
        raise ValueError(
            f"fades of {fade_in_samples} and {fade_out_samples} samples do not fit into {sample_count}; shorten them"
        )
    envelope = np.ones(sample_count)
    envelope[:fade_in_samples] = 0.5 - 0.5 * np.cos(np.pi * np.arange(fade_in_samples) / max(fade_in_samples, 1))
    envelope[sample_count - fade_out_samples :] = 0.5 + 0.5 * np.cos(
        np.pi * np.arange(1, fade_out_samples + 1) / max(fade_out_samples, 1)
    )
    return samples * envelope.reshape((sample_count,) + (1,) * (samples.ndim - 1))
