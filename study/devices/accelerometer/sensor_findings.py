"""Findings of `hapteq doctor` about an accelerometer at rest: sample rate, lost packets, clock drift and delay, noise.

The findings are warnings: none of them prevents the use of a device. Each says what to do.
"""

import time

from study.devices.accelerometer.sensor import Accelerometer
from study.session.facts.sensor_facts import SensorFacts
from study.session.views.views import DeviceFinding

LISTENED_S = 3.0
"""Time (s) for which the sensor is read; the drift of its clock is then known to about 50 ppm."""

ENOUGH_PER_S = 1900.0
"""Lowest accepted rate (samples per second): 2 kHz less the tolerance of a clock. The margin to twice the corner
frequency of the sensor's 500 Hz filter limits aliasing."""

FEW_LOST = 0.001
"""Largest accepted share of lost packets; a sound connection loses none."""

PLAUSIBLE_PPM = 500.0
"""Largest plausible drift (ppm): a quartz is within 100 ppm; a ceramic resonator is only within 5000 ppm, and its rate
varies."""

LATE_S = 0.05
"""Longest accepted delay of a packet (s): with a longer one the newest sample is too old for the present tick."""

NOISY_MPS2 = 0.3
"""Largest accepted rms noise of an axis (m/s²). An ADXL335 with a 500 Hz low-pass has 0.04 (x, y) and 0.08 (z)."""


def sensor_findings(sensor: Accelerometer) -> tuple[DeviceFinding, ...]:
    """Read the sensor for `LISTENED_S` and judge it. The handle must be at rest."""
    time.sleep(LISTENED_S)
    facts, noise_mps2, per_s = sensor.rest(LISTENED_S)
    return (_rate(per_s), _losses(facts), _clock(facts), _noise([float(axis) for axis in noise_mps2]))


def _rate(per_s: float) -> DeviceFinding:
    """Finding on the sample rate (samples per second)."""
    advice = "At least 2000 are wanted: make PERIOD_US in the firmware smaller (docs/firmware/accelerometer.ino)."
    return _finding("Sensor rate", f"{per_s:.0f} samples per second", per_s >= ENOUGH_PER_S, advice)


def _losses(facts: SensorFacts) -> DeviceFinding:
    """Finding on lost packets and restarts of the board."""
    came = facts.packets + facts.lost
    value = f"{facts.lost} of {came} packets lost, torn or garbled, {facts.spoiled_bytes} bytes that were no packet"
    advice = "Take a short cable and a USB port of the computer itself, no hub; end programs that keep it busy."
    if facts.restarts:
        value += f"; the board restarted {facts.restarts} times"
        advice = "The board loses its power, or its program crashes: check its cable, and flash it again."
    return _finding("Sensor losses", value, not facts.restarts and facts.lost <= FEW_LOST * came, advice)


def _clock(facts: SensorFacts) -> DeviceFinding:
    """Finding on the drift of the sensor's clock and on the longest delay of a packet."""
    if facts.drift_ppm is None or facts.longest_delay_s is None:
        advice = "Without it no sample can be put on a tick: close other programs that read this line, then try again."
        return _finding("Sensor clock", "it could not be fitted to this computer's", False, advice)
    way = "slow" if facts.drift_ppm > 0 else "fast"
    late_ms = 1000 * facts.longest_delay_s
    value = f"{abs(facts.drift_ppm):.0f} ppm {way} relative to this computer's; packets up to {late_ms:.1f} ms late"
    drifts = abs(facts.drift_ppm) > PLAUSIBLE_PPM
    advice = (
        "No quartz is that far off: check that the firmware's time stamps are in microseconds."
        if drifts
        else "This computer is busy: end other programs."
    )
    return _finding("Sensor clock", value, not drifts and facts.longest_delay_s <= LATE_S, advice)


def _noise(noise_mps2: list[float]) -> DeviceFinding:
    """Finding on the noise of each axis (m/s² rms); exactly zero is a channel without a signal."""
    value = f"{', '.join(f'{axis:.3f}' for axis in noise_mps2)} m/s² rms at rest (x, y, z)"
    advice = (
        "Let go of the handle and check again. If the noise persists: check the sensor's capacitors, cable and supply."
    )
    if any(axis == 0.0 for axis in noise_mps2):
        value, advice = (
            f"{value}: a channel does not move at all",
            "Check its wire: it does not reach the board's input.",
        )
    return _finding("Sensor noise", value, bool(min(noise_mps2) > 0.0 and max(noise_mps2) <= NOISY_MPS2), advice)


def _finding(name: str, value: str, fine: bool, advice: str) -> DeviceFinding:
    """A finding; where it is not fine, a warning with advice."""
    return DeviceFinding(name, value, fine, "" if fine else advice, warning=not fine)
