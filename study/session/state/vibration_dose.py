"""Vibration dose of a hand: daily exposure A(8) of hand-transmitted vibration.

    A(8) = sqrt( (1 / T0) * integral of a_hw(t)^2 dt ),        T0 = 8 h

a_hw: rms acceleration, weighted by Wh. Source: ISO 5349-1:2001 (weighting Wh, its band limits, and A(8)); the analogue
filter is that of its annex A. Directive 2002/44/EC sets an action value of 2.5 m/s^2 and a limit value of 5 m/s^2 for
A(8). Both apply to the vector sum of three axes, which equals the acceleration along the stimulus where a stimulus has
a single direction.
"""

import math
from dataclasses import dataclass, replace

WORKING_DAY_S = 8 * 3600.0
"""Reference duration T0 of A(8) (s): eight hours."""

_F1_HZ, _F2_HZ, _Q1 = 10**0.8, 10**3.1, 0.71
"""Band limits of Wh: corner frequencies (Hz) of a second-order high-pass and low-pass, and their quality factor."""
_F3_HZ = _F4_HZ = 100 / (2 * math.pi)
"""Corner frequencies of the transition (15.9 Hz): below, Wh weights acceleration evenly; above, velocity."""
_Q2 = 0.64
"""Quality factor of that transition, whose gain at low frequencies is 1."""


@dataclass(frozen=True, slots=True)
class Dose:
    """Accumulated hand-arm vibration."""

    squared_s: float
    """Integral of the squared weighted rms acceleration, (m/s^2)^2 s."""
    vibrated_s: float
    """Total duration of vibration (s), measured or not."""
    unmeasured_s: float
    """Part of `vibrated_s` with unknown amplitude, which is missing in `squared_s`: A(8) is underestimated."""


NO_DOSE = Dose(0.0, 0.0, 0.0)
"""Dose before the first vibration."""


def compute_hand_arm_weight(frequency_hz: float) -> float:
    """Compute the frequency weighting Wh of an acceleration: |band transition| at s = 2 pi i f, with wn = 2 pi fn and

        band = s² w2² / ((s² + s w1/Q1 + w1²) (s² + s w2/Q1 + w2²))
        transition = (s + w3) w4² / ((s² + s w4/Q2 + w4²) w3)

    The standard defines it for octave bands of 8 Hz to 1 kHz, that is from 5.6 Hz. Below, the same filter is used; it
    is 0.55 at 5 Hz and, far below its corner, falls with the square of the frequency. Raises ValueError for a frequency
    that is not above 0.
    """
    if frequency_hz <= 0:
        raise ValueError(f"frequency_hz is {frequency_hz:g}; a weight exists above 0 Hz")
    s = 2j * math.pi * frequency_hz
    w1, w2, w3, w4 = (2 * math.pi * f_hz for f_hz in (_F1_HZ, _F2_HZ, _F3_HZ, _F4_HZ))
    band = s**2 * w2**2 / ((s**2 + s * w1 / _Q1 + w1**2) * (s**2 + s * w2 / _Q1 + w2**2))
    transition = (s + w3) * w4**2 / ((s**2 + s * w4 / _Q2 + w4**2) * w3)
    return abs(band * transition)


def add_sinusoid(dose: Dose, frequency_hz: float, amplitude_mps2: float | None, duration_s: float) -> Dose:
    """Add a sinusoid of this duration (s) to a dose; returns the sum. amplitude_mps2: peak; None if unknown, which adds
    to `unmeasured_s` instead of `squared_s`.

    The fades are part of the duration, and count at full amplitude, so that they are overestimated. Raises ValueError
    for a negative duration and, with a known amplitude, for a frequency that is not above 0.
    """
    if duration_s < 0:
        raise ValueError(f"duration_s is {duration_s:g}; a vibration lasts 0 s or longer")
    extended_dose = replace(dose, vibrated_s=dose.vibrated_s + duration_s)
    if amplitude_mps2 is None:
        return replace(extended_dose, unmeasured_s=dose.unmeasured_s + duration_s)
    weighted_rms_mps2 = compute_hand_arm_weight(frequency_hz) * amplitude_mps2 / math.sqrt(2)
    return replace(extended_dose, squared_s=dose.squared_s + weighted_rms_mps2**2 * duration_s)


def sum_doses(*doses: Dose) -> Dose:
    """Add up the doses of a hand on a day; returns `NO_DOSE` without any."""
    return Dose(
        squared_s=sum(dose.squared_s for dose in doses),
        vibrated_s=sum(dose.vibrated_s for dose in doses),
        unmeasured_s=sum(dose.unmeasured_s for dose in doses),
    )


def compute_a8_mps2(dose: Dose) -> float:
    """Compute the daily exposure A(8): the constant weighted rms acceleration (m/s^2) over eight hours with the same
    dose."""
    return math.sqrt(dose.squared_s / WORKING_DAY_S)
