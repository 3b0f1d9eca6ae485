"""Lock-in: amplitude and phase of a known frequency in noisy samples."""

import numpy as np
import numpy.typing as npt

from equalizer.signals.signal import FloatArray

ComplexArray = npt.NDArray[np.complex128]


def phasors(samples: FloatArray, sample_rate_hz: float, frequency_hz: float, harmonics: int = 1) -> ComplexArray:
    """Least-squares amplitude phasors of the fundamental and its harmonics, offset and linear drift removed.

    samples: (n, channels). Returns (harmonics, channels): row h - 1 is a with x(t) = Re(a exp(2 pi i h f t)).
    Fitted rather than summed over periods, so that the samples need not hold a whole number of them.
    Raises ValueError when there is less than one period, or a harmonic lies at or above half the rate.
    """
    n = samples.shape[0]
    if n < sample_rate_hz / frequency_hz:
        raise ValueError(f"{n} samples are less than one period of {frequency_hz} Hz at {sample_rate_hz} Hz")
    if harmonics * frequency_hz >= sample_rate_hz / 2:
        raise ValueError(f"harmonic {harmonics} of {frequency_hz} Hz is not below half of {sample_rate_hz} Hz")
    t = np.arange(n) / sample_rate_hz
    drift = np.linspace(-1.0, 1.0, n)
    angles = 2 * np.pi * frequency_hz * t[:, None] * np.arange(1, harmonics + 1)
    basis = np.hstack([np.ones((n, 1)), drift[:, None], np.cos(angles), -np.sin(angles)])
    fitted = np.linalg.lstsq(basis, samples, rcond=None)[0][2:]
    return np.asarray(fitted[:harmonics] + 1j * fitted[harmonics:], dtype=np.complex128)
