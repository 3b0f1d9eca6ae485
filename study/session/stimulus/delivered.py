"""Delivered stimulus of a trial: acceleration along and across the direction, its harmonics, and displacement."""

import math
from dataclasses import dataclass

import numpy as np

from equalizer.signals.lockin import covers_a_period, phasors
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray

HIGHEST_HARMONIC = 5
"""Highest harmonic, as for acceleration ellipses: a mechanism transmits little beyond it."""

STIFFEST_N_PER_M, STRONGEST_DAMPING_N_S_PER_M, HEAVIEST_KG = 2000.0, 30.0, 3.0
"""Assumed upper limits of the hand: more than four times a whole arm (135 N/m, 6.5 N s/m, 0.55 kg by Sci. Rep.
srep18004). The device's own mass is added."""

LEAST_MPS2 = 0.1
"""Where even less may arrive, a sensor's noise could hide it: nothing is said then."""


@dataclass(frozen=True, slots=True)
class Delivered:
    """Amplitudes at the stimulus frequency."""

    along_mps2: float
    off_axis_mps2: float
    displacement_mm: float
    harmonics_mps2: float | None = None
    """Root of the summed squares of the amplitudes at 2 to 5 times the frequency, over all axes, as far as they lie
    below half the sample rate; None where not even the second does."""


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
        # From the accelerometer at the handle: encoders are behind elastic cables.
        displacement_mm=1000.0 * float(np.abs(along)) / (2 * np.pi * frequency_hz) ** 2,
        harmonics_mps2=_harmonics(recording, frequency_hz),
    )


def hardly_arrived(
    recording: Recording, unit_vector: FloatArray, frequency_hz: float, friction_n: float, device_kg: float
) -> bool:
    """Whether the acceleration along the direction is less than the stiffest, heaviest hand leaves of the force sent:
    motors that do nothing, a blocked handle, a dead sensor, or an antiresonance at this frequency. friction_n: force
    that may move nothing; device_kg: effective mass of the device without a hand. Both amplitudes are fitted at the
    stimulus frequency; the recording has at least one period, as for `measure_delivered`."""
    rate_hz, w = recording.sample_rate_hz, 2 * math.pi * frequency_hz
    force_n = abs(phasors(recording.command.samples, rate_hz, frequency_hz)[0] @ unit_vector)
    along_mps2 = abs(phasors(recording.response.samples, rate_hz, frequency_hz)[0] @ unit_vector)
    opposed = STIFFEST_N_PER_M + STRONGEST_DAMPING_N_S_PER_M * w + (HEAVIEST_KG + device_kg) * w**2
    least_mps2 = (force_n - friction_n) * w**2 / opposed
    return bool(least_mps2 >= LEAST_MPS2 and along_mps2 < least_mps2)


def _harmonics(recording: Recording, frequency_hz: float) -> float | None:
    below = math.ceil(recording.sample_rate_hz / 2 / frequency_hz) - 1
    highest = min(HIGHEST_HARMONIC, below)
    if highest < 2:
        return None
    # Harmonics are fitted separately: the fundamental of older sessions was fitted without them, and must not change.
    found = phasors(recording.response.samples, recording.sample_rate_hz, frequency_hz, highest)
    return float(np.linalg.norm(found[1:]))
