"""Delivered stimulus of a trial: acceleration along and across the played direction, harmonics, and displacement.

The amplitudes are phasors, fitted to the measured acceleration at the stimulus frequency and its harmonics
(`equalizer.signals.lockin`).
"""

import math
from dataclasses import dataclass

import numpy as np

from equalizer.signals.lockin import covers_a_period, estimate_phasors
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray

HIGHEST_HARMONIC = 5
"""Highest harmonic that is measured, because a mechanism transmits little beyond it; the same as in the acceleration
ellipses."""

STIFFEST_N_PER_M, STRONGEST_DAMPING_N_S_PER_M, HEAVIEST_KG = 2000.0, 30.0, 3.0
"""Assumed upper limits of the hand's stiffness (N/m), damping (N s/m) and mass (kg): more than four times those of a
whole arm (135 N/m, 6.5 N s/m, 0.55 kg by Sci. Rep. srep18004). The device's own mass is added."""

LEAST_MPS2 = 0.1
"""Least expected acceleration (m/s²) for which `has_hardly_moved` decides; a smaller one could be hidden by the
sensor's noise."""


@dataclass(frozen=True, slots=True)
class Delivered:
    """Peak amplitudes of the delivered motion at the stimulus frequency."""

    along_mps2: float
    """Acceleration along the played direction."""
    off_axis_mps2: float
    """Norm of the acceleration phasor across that direction."""
    displacement_mm: float
    """Displacement along the direction: acceleration over (2 pi f)^2."""
    harmonics_mps2: float | None = None
    """Root of the summed squares of the amplitudes at 2 to 5 times the frequency, over all axes, as far as they lie
    below half the sample rate; None where not even the second does."""


def measure_delivered(recording: Recording, unit_vector: FloatArray, frequency_hz: float) -> Delivered | None:
    """Amplitudes from a trial's recording, by a least-squares fit of a sinusoid at the stimulus frequency; None if less
    than one period was measured. unit_vector: (3,), the direction played."""
    measured = int(np.isfinite(recording.response.samples).all(axis=1).sum())
    if not covers_a_period(measured, recording.sample_rate_hz, frequency_hz):
        return None
    acceleration = estimate_phasors(recording.response.samples, recording.sample_rate_hz, frequency_hz)[0]
    along_direction = acceleration @ unit_vector
    off_axis = acceleration - along_direction * unit_vector
    return Delivered(
        along_mps2=float(np.abs(along_direction)),
        off_axis_mps2=float(np.linalg.norm(off_axis)),
        # From the accelerometer at the handle, because the encoders measure behind elastic cables.
        displacement_mm=1000.0 * float(np.abs(along_direction)) / (2 * np.pi * frequency_hz) ** 2,
        harmonics_mps2=_harmonics(recording, frequency_hz),
    )


def has_hardly_moved(
    recording: Recording, unit_vector: FloatArray, frequency_hz: float, friction_n: float, device_kg: float
) -> bool:
    """Whether less acceleration arrived than with the stiffest, heaviest assumed hand:

    |a| < (|F| - friction_n) w² / (K + C w + (M + device_kg) w²), the least acceleration for any phase of the three
    terms. Causes: motors without force, a blocked handle, a dead sensor, an antiresonance. F, a: phasors of commanded
    force and acceleration along the direction; friction_n: force that may cause no motion; device_kg: effective mass of
    the device alone. Raises ValueError for less than one period."""
    rate_hz, w = recording.sample_rate_hz, 2 * math.pi * frequency_hz
    force_n = abs(estimate_phasors(recording.command.samples, rate_hz, frequency_hz)[0] @ unit_vector)
    along_mps2 = abs(estimate_phasors(recording.response.samples, rate_hz, frequency_hz)[0] @ unit_vector)
    opposed = STIFFEST_N_PER_M + STRONGEST_DAMPING_N_S_PER_M * w + (HEAVIEST_KG + device_kg) * w**2
    least_mps2 = (force_n - friction_n) * w**2 / opposed
    return bool(least_mps2 >= LEAST_MPS2 and along_mps2 < least_mps2)


def _harmonics(recording: Recording, frequency_hz: float) -> float | None:
    """As `Delivered.harmonics_mps2`."""
    highest_below_nyquist = math.ceil(recording.sample_rate_hz / 2 / frequency_hz) - 1
    highest = min(HIGHEST_HARMONIC, highest_below_nyquist)
    if highest < 2:
        return None
    # A separate fit, so that the fundamental is the same as in earlier sessions, which were fitted without harmonics.
    harmonic_phasors = estimate_phasors(recording.response.samples, recording.sample_rate_hz, frequency_hz, highest)
    return float(np.linalg.norm(harmonic_phasors[1:]))
