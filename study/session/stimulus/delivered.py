"""Delivered stimulus of a trial: acceleration along and across the direction, and displacement."""

from dataclasses import dataclass

import numpy as np

from equalizer.signals.lockin import covers_a_period, phasors
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray


@dataclass(frozen=True, slots=True)
class Delivered:
    """Amplitudes at the stimulus frequency."""

    along_mps2: float
    off_axis_mps2: float
    displacement_mm: float


def measure_delivered(recording: Recording, unit_vector: FloatArray, frequency_hz: float) -> Delivered | None:
    """Amplitudes from a trial's recording by a Fourier projection at the stimulus frequency; None if less than one
    period was measured. unit_vector: (3,), the direction played."""
    measured = int(np.isfinite(recording.response.samples).all(axis=1).sum())
    if not covers_a_period(measured, recording.sample_rate_hz, frequency_hz):
        return None
    acceleration = phasors(recording.response.samples, recording.sample_rate_hz, frequency_hz)[0]
    along = acceleration @ unit_vector
    off_axis = acceleration - along * unit_vector
    return Delivered(
        along_mps2=float(np.abs(along)),
        off_axis_mps2=float(np.linalg.norm(off_axis)),
        # Of the handle, as the accelerometer sees it: encoders sit behind cables that give way.
        displacement_mm=1000.0 * float(np.abs(along)) / (2 * np.pi * frequency_hz) ** 2,
    )
