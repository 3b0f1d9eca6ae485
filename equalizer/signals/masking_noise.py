"""Pink noise that masks the sound of a device, as a periodic signal that can be repeated without a discontinuity.

It prevents a participant from answering by the sound of the vibration. The noise is made in the frequency domain: power
density proportional to 1/f between two corner frequencies (-3 dB per octave) and none outside, random phases, then an
inverse FFT. Called by `study.workflows.session.write_masking_noise` (a file) and `study.workflows.trial.masking`
(playback in a session).
"""

import math

import numpy as np
import scipy.fft
from numpy.typing import NDArray

HEADROOM_DB = 3.0
"""Distance of the largest sample from full scale (dB), because the analog signal may exceed it between samples.
Chosen."""

FULL_SCALE = 2**15 - 1
"""Largest value of a signed 16 bit sample."""


def make_masking_noise(
    seconds: int, low_hz: float, high_hz: float, seed: int, sample_rate_hz: int = 44_100
) -> NDArray[np.int16]:
    """Make one period of pink noise, mono, 16 bit, shape (seconds * sample_rate_hz,).

    Every line of the spectrum from low_hz to high_hz has an amplitude proportional to 1 / sqrt(f) and a random phase,
    so that the slope is exact and, with many lines, the samples are nearly normally distributed. Raises ValueError for
    less than 1 s, unless 0 < low_hz < high_hz <= half the sample rate, and for a band without a line.
    """
    if seconds < 1:
        raise ValueError(f"seconds is {seconds}; noise lasts at least 1 s")
    if not 0 < low_hz < high_hz <= sample_rate_hz / 2:
        raise ValueError(
            f"noise needs 0 < low_hz < high_hz <= {sample_rate_hz / 2:g} Hz (half the rate), "
            f"not {low_hz:g} to {high_hz:g}"
        )
    # Lines are 1 / seconds (Hz) apart. Where the whole number `seconds` is a product of small primes, so is the number
    # of samples at 44 100 Hz, and the FFT is fast.
    first_line, last_line = math.ceil(low_hz * seconds), math.floor(high_hz * seconds)
    if last_line < first_line:
        raise ValueError(f"no multiple of 1 / {seconds} Hz lies between {low_hz:g} and {high_hz:g} Hz")
    sample_count = seconds * sample_rate_hz
    # Single precision is far finer than 16 bit and halves the memory that minutes of noise need.
    phases = 2 * np.pi * np.random.default_rng(seed).random(last_line - first_line + 1, dtype=np.float32)
    spectrum = np.zeros(sample_count // 2 + 1, dtype=np.complex64)
    spectrum[first_line : last_line + 1] = np.exp(1j * phases) / np.sqrt(
        np.arange(first_line, last_line + 1, dtype=np.float32)
    )
    wave = scipy.fft.irfft(spectrum, sample_count)
    wave *= FULL_SCALE * 10 ** (-HEADROOM_DB / 20) / np.abs(wave).max()
    samples: NDArray[np.int16] = np.rint(wave).astype(np.int16)
    return samples
