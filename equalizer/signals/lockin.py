"""Lock-in detection: amplitude and phase of a sinusoid of known frequency in noisy samples, by linear least squares.

Each channel is modelled as an offset, a linear drift, a fundamental and its harmonics, h = 1, 2, ...:

    x(t) = c + d t + sum over h of Re(a_h exp(2 pi i h f t))

Used for the acceleration that a stimulus caused (`study.session.stimulus.delivered`) and for its ellipses
(`analysis.psychophysics.ellipsoid`).
"""

import numpy as np

from equalizer.signals.signal import ComplexArray, FloatArray


def estimate_phasors(
    samples: FloatArray, sample_rate_hz: float, frequency_hz: float, harmonics: int = 1
) -> ComplexArray:
    """Estimate the complex amplitudes (phasors) a_h of the fundamental and its harmonics.

    samples: (n, channels). harmonics: number of components, with the fundamental. Returns (harmonics, channels), in the
    unit of the samples: row h - 1 is a_h, with t = 0 at the first sample. Because offset, drift and components are
    fitted together, the samples need not cover whole periods. Rows with a NaN or infinite value are left out. Raises
    ValueError where the other rows are fewer than one period has, or a harmonic lies at or above half the sample rate.
    """
    is_complete = np.isfinite(samples).all(axis=1)
    if not covers_a_period(int(is_complete.sum()), sample_rate_hz, frequency_hz):
        raise ValueError(
            f"{int(is_complete.sum())} samples are less than one period of {frequency_hz} Hz at {sample_rate_hz} Hz"
        )
    if harmonics * frequency_hz >= sample_rate_hz / 2:
        raise ValueError(f"harmonic {harmonics} of {frequency_hz} Hz is not below half of {sample_rate_hz} Hz")
    samples, row_indices = samples[is_complete], np.flatnonzero(is_complete)
    row_count = len(row_indices)
    time_s = row_indices / sample_rate_hz
    drift = row_indices / row_indices[-1] - 0.5
    angles = 2 * np.pi * frequency_hz * time_s[:, None] * np.arange(1, harmonics + 1)
    basis = np.hstack([np.ones((row_count, 1)), drift[:, None], np.cos(angles), -np.sin(angles)])
    coefficients = np.linalg.lstsq(basis, samples, rcond=None)[0][2:]
    return np.asarray(coefficients[:harmonics] + 1j * coefficients[harmonics:], dtype=np.complex128)


def covers_a_period(sample_count: int, sample_rate_hz: float, frequency_hz: float) -> bool:
    """Whether sample_count is at least the number of samples in one period, rounded down."""
    return sample_count >= int(sample_rate_hz / frequency_hz)
