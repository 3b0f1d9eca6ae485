"""What a trial really delivered: acceleration along and off the direction, and displacement."""

from dataclasses import dataclass

import numpy as np

from equalizer.signals.lockin import phasors
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray


@dataclass(frozen=True, slots=True)
class Delivered:
    """Amplitudes at the stimulus frequency."""

    along_mps2: float
    off_axis_mps2: float
    displacement_mm: float | None


def delivered(recording: Recording, unit_vector: FloatArray, frequency_hz: float) -> Delivered | None:
    """None where the recording is shorter than one period. unit_vector: (3,), the direction played."""
    if len(recording) < recording.sample_rate_hz / frequency_hz:
        return None
    acceleration = phasors(recording.response.samples, recording.sample_rate_hz, frequency_hz)[0]
    along = acceleration @ unit_vector
    off_axis = acceleration - along * unit_vector
    return Delivered(
        along_mps2=float(np.abs(along)),
        off_axis_mps2=float(np.linalg.norm(off_axis)),
        displacement_mm=_displacement_mm(recording, unit_vector, frequency_hz),
    )


def _displacement_mm(recording: Recording, unit_vector: FloatArray, frequency_hz: float) -> float | None:
    if recording.position is None:
        return None
    position = phasors(recording.position.samples, recording.sample_rate_hz, frequency_hz)[0]
    return float(np.abs(position @ unit_vector)) * 1000.0
