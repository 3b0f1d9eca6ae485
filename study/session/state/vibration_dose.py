"""The vibration that a hand has had in a sitting: daily exposure A(8) of hand-transmitted vibration.

Source: ISO 5349-1:2001 (weighting Wh, its band limits, and A(8)); the analogue filter is that of its annex A.
Directive 2002/44/EC acts on A(8) at 2.5 m/s^2 (action value) and 5 m/s^2 (limit value). Both are meant for the
vector sum of three axes; a stimulus along one direction has its whole sum in that direction.
"""

import math
from dataclasses import dataclass, replace

ACTION_VALUE_MPS2 = 2.5
LIMIT_VALUE_MPS2 = 5.0
"""Of A(8), directive 2002/44/EC, article 3."""

WORKING_DAY_S = 8 * 3600.0

_F1_HZ, _F2_HZ, _Q1 = 10**0.8, 10**3.1, 0.71
"""Band limits: second-order high-pass and low-pass."""
_F3_HZ = _F4_HZ = 100 / (2 * math.pi)
_Q2 = 0.64
"""Transition from constant acceleration to constant velocity, gain 1."""


@dataclass(frozen=True, slots=True)
class Dose:
    squared_s: float
    """Sum of the weighted rms squared times its seconds, (m/s^2)^2 s."""
    vibrated_s: float
    """All seconds of vibration, measured or not."""
    unmeasured_s: float
    """Those without a known amplitude: they are in `vibrated_s` and not in `squared_s`, so A(8) is too low by them."""


NO_DOSE = Dose(0.0, 0.0, 0.0)


def hand_arm_weight(frequency_hz: float) -> float:
    """Factor by which Wh weights an acceleration of this frequency.

    The standard is stated for the octave bands of 8 Hz to 1 kHz, from 5.6 Hz on. Below, the same filter goes on:
    it falls with the square of the frequency, 0.55 at 5 Hz; so slow a motion is no hazard of this kind.
    """
    if frequency_hz <= 0:
        raise ValueError(f"frequency_hz is {frequency_hz:g}; a weight exists above 0 Hz")
    s = 2j * math.pi * frequency_hz
    w1, w2, w3, w4 = (2 * math.pi * f_hz for f_hz in (_F1_HZ, _F2_HZ, _F3_HZ, _F4_HZ))
    band = s**2 * w2**2 / ((s**2 + s * w1 / _Q1 + w1**2) * (s**2 + s * w2 / _Q1 + w2**2))
    transition = (s + w3) * w4**2 / ((s**2 + s * w4 / _Q2 + w4**2) * w3)
    return abs(band * transition)


def add(dose: Dose, frequency_hz: float, amplitude_mps2: float | None, seconds: float) -> Dose:
    """The dose after one more sinusoid. amplitude_mps2: its peak; None where nothing was measured.

    Fades counted at full amplitude make the dose too high, never too low.
    """
    if seconds < 0:
        raise ValueError(f"seconds is {seconds:g}; a vibration lasts 0 s or longer")
    longer = replace(dose, vibrated_s=dose.vibrated_s + seconds)
    if amplitude_mps2 is None:
        return replace(longer, unmeasured_s=dose.unmeasured_s + seconds)
    return replace(longer, squared_s=dose.squared_s + _weighted_rms(frequency_hz, amplitude_mps2) ** 2 * seconds)


def total(*doses: Dose) -> Dose:
    """Of one hand on one day."""
    return Dose(
        squared_s=sum(dose.squared_s for dose in doses),
        vibrated_s=sum(dose.vibrated_s for dose in doses),
        unmeasured_s=sum(dose.unmeasured_s for dose in doses),
    )


def a8_mps2(dose: Dose) -> float:
    """The exposure as the constant weighted rms acceleration that would give it in eight hours."""
    return math.sqrt(dose.squared_s / WORKING_DAY_S)


def amplitude_that_fits_mps2(dose: Dose, a8_limit_mps2: float, frequency_hz: float, seconds: float) -> float:
    """Highest peak amplitude which, played for so many seconds more, leaves A(8) at or below the limit.

    0 where nothing is left. Raises ValueError unless seconds is above 0.
    """
    if seconds <= 0:
        raise ValueError(f"seconds is {seconds:g}; it must be above 0")
    left = a8_limit_mps2**2 * WORKING_DAY_S - dose.squared_s
    return math.sqrt(2 * max(0.0, left) / seconds) / hand_arm_weight(frequency_hz)


def _weighted_rms(frequency_hz: float, amplitude_mps2: float) -> float:
    return hand_arm_weight(frequency_hz) * amplitude_mps2 / math.sqrt(2)
