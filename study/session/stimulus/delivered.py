"""Delivered stimulus of a trial: acceleration along and across the played direction, harmonics, and displacement.

The amplitudes are those of phasors, fitted to the measured acceleration at the stimulus frequency and its harmonics
(`equalizer.signals.lockin`).
"""

import math
from dataclasses import dataclass

import numpy as np

from equalizer.signals.lockin import covers_a_period, estimate_phasors
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray

HIGHEST_HARMONIC = 5
"""Highest harmonic that is measured. Chosen: a mechanism transmits little beyond it."""

MAX_HAND_STIFFNESS_N_PER_M, MAX_HAND_DAMPING_N_S_PER_M, MAX_HAND_MASS_KG = 2000.0, 30.0, 3.0
"""Assumed upper limits of the hand's stiffness (N/m), damping (N s/m) and mass (kg). Chosen: more than four times those
of a whole arm (135 N/m, 6.5 N s/m, 0.55 kg; Scientific Reports, doi 10.1038/srep18004)."""

MAX_AMPLITUDE_MPS2 = 1e5
"""Largest amplitude (m/s²) that counts as measured; one above it shows a sensor whose sensitivity is set wrong, and
might exceed the range of a log. Chosen: 10,000 times gravity."""

MIN_EXPECTED_MPS2 = 0.1
"""Smallest expected acceleration (m/s²) at which `has_too_little_motion` can be true. Chosen: a smaller one could be
masked by the sensor's noise."""


@dataclass(frozen=True, slots=True)
class DeliveredMotion:
    """Peak amplitudes of the delivered motion, at the stimulus frequency and its harmonics; units are in the names."""

    along_mps2: float
    """Acceleration along the played direction."""
    off_axis_mps2: float
    """Norm of the acceleration phasor across that direction."""
    displacement_mm: float
    """Displacement along the direction: acceleration over (2 pi f)^2."""
    harmonics_mps2: float | None = None
    """Root of the summed squares of the amplitudes at 2 to 5 times the frequency, over all axes, as far as they lie
    below half the sample rate; None where not even the second does."""


def measure_delivered(recording: Recording, unit_vector: FloatArray, frequency_hz: float) -> DeliveredMotion | None:
    """Measure the amplitudes in a trial's recording, by a least-squares fit of a sinusoid at the stimulus frequency;
    None if less than one period was measured, or an acceleration above `MAX_AMPLITUDE_MPS2`. unit_vector: (3,), the
    direction played."""
    measured_samples = int(np.isfinite(recording.response.samples).all(axis=1).sum())
    if not covers_a_period(measured_samples, recording.sample_rate_hz, frequency_hz):
        return None
    acceleration_phasor = estimate_phasors(recording.response.samples, recording.sample_rate_hz, frequency_hz)[0]
    along_phasor = acceleration_phasor @ unit_vector
    off_axis_phasor = acceleration_phasor - along_phasor * unit_vector
    delivered = DeliveredMotion(
        along_mps2=float(np.abs(along_phasor)),
        off_axis_mps2=float(np.linalg.norm(off_axis_phasor)),
        # From the accelerometer at the handle, because the encoders measure behind elastic cables.
        displacement_mm=1000.0 * float(np.abs(along_phasor)) / (2 * np.pi * frequency_hz) ** 2,
        harmonics_mps2=_measure_harmonics_mps2(recording, frequency_hz),
    )
    amplitudes_mps2 = (delivered.along_mps2, delivered.off_axis_mps2, delivered.harmonics_mps2 or 0.0)
    return delivered if all(amplitude <= MAX_AMPLITUDE_MPS2 for amplitude in amplitudes_mps2) else None


def has_too_little_motion(
    recording: Recording, unit_vector: FloatArray, frequency_hz: float, friction_n: float, device_kg: float
) -> bool:
    """Whether the acceleration is smaller than with the stiffest and heaviest hand that is assumed:

    |a| < e = (|F| - friction_n) w² / (K + C w + (M + device_kg) w²), the smallest acceleration for any phase of the
    three terms; False where e is below `MIN_EXPECTED_MPS2`. Causes: motors without force, a blocked handle, a dead
    sensor, an antiresonance. F, a: phasors of commanded force (N) and acceleration (m/s²) along unit_vector, (3,); K,
    C, M: the assumed limits of the hand; w = 2 pi frequency_hz; friction_n: dry friction, the force below which nothing
    may move; device_kg: effective mass of the device alone. Raises ValueError for less than one period."""
    rate_hz, w = recording.sample_rate_hz, 2 * math.pi * frequency_hz
    force_n = abs(estimate_phasors(recording.command.samples, rate_hz, frequency_hz)[0] @ unit_vector)
    along_mps2 = abs(estimate_phasors(recording.response.samples, rate_hz, frequency_hz)[0] @ unit_vector)
    dynamic_stiffness_n_per_m = (
        MAX_HAND_STIFFNESS_N_PER_M + MAX_HAND_DAMPING_N_S_PER_M * w + (MAX_HAND_MASS_KG + device_kg) * w**2
    )
    expected_mps2 = (force_n - friction_n) * w**2 / dynamic_stiffness_n_per_m
    return bool(expected_mps2 >= MIN_EXPECTED_MPS2 and along_mps2 < expected_mps2)


def _measure_harmonics_mps2(recording: Recording, frequency_hz: float) -> float | None:
    """Measure the harmonics, as `DeliveredMotion.harmonics_mps2` states."""
    highest_below_nyquist = math.ceil(recording.sample_rate_hz / 2 / frequency_hz) - 1
    highest_harmonic = min(HIGHEST_HARMONIC, highest_below_nyquist)
    if highest_harmonic < 2:
        return None
    # A separate fit, so that the fundamental is the same as in earlier sessions, which were fitted without harmonics.
    harmonic_phasors = estimate_phasors(
        recording.response.samples, recording.sample_rate_hz, frequency_hz, highest_harmonic
    )
    return float(np.linalg.norm(harmonic_phasors[1:]))
