"""Findings of `hapteq doctor` about an accelerometer at rest: sample rate, lost packets, clock drift and delay, noise.

A finding out of its limits is a warning with a remedy; none prevents the use of a device. The limits are chosen.
"""

import time

from study.devices.accelerometer.sensor import Accelerometer
from study.session.facts.sensor_facts import SensorFacts
from study.session.views.participant_views import DeviceFinding

MEASUREMENT_S = 3.0
"""Time (s) for which the sensor is read; it determines the drift of its clock to about 50 ppm."""

MIN_RATE_HZ = 1900.0
"""Lowest accepted sample rate (Hz): 2 kHz less the tolerance of a clock. Twice the corner frequency of the sensor's
500 Hz low-pass filter would be 1 kHz; the margin limits aliasing."""

MAX_LOST_SHARE = 0.001
"""Largest accepted share of lost packets; an intact connection loses none."""

MAX_DRIFT_PPM = 500.0
"""Largest plausible drift (ppm): a quartz is within 100 ppm; a ceramic resonator is only within 5000 ppm, and its rate
varies."""

MAX_DELAY_S = 0.05
"""Longest accepted delay of a packet (s), equal to the age from which the control loop treats the newest sample as
missing (`newest_sample.MAX_AGE_S`)."""

MAX_NOISE_MPS2 = 0.3
"""Largest accepted rms noise of an axis (m/s²). An ADXL335 with a 500 Hz low-pass has 0.04 (x, y) and 0.08 (z)."""


def check_sensor(sensor: Accelerometer) -> tuple[DeviceFinding, ...]:
    """Measure the sensor for `MEASUREMENT_S` and compare with the limits. The handle must be at rest."""
    time.sleep(MEASUREMENT_S)
    facts, noise_mps2, rate_hz = sensor.measure_rest(MEASUREMENT_S)
    return (
        _check_rate(rate_hz),
        _check_losses(facts),
        _check_clock(facts),
        _check_noise([float(axis_noise) for axis_noise in noise_mps2]),
    )


def _check_rate(rate_hz: float) -> DeviceFinding:
    """Check the sample rate (Hz)."""
    advice = "At least 2000 are wanted: make PERIOD_US in the firmware smaller (docs/firmware/accelerometer.ino)."
    return _make_finding("Sensor rate", f"{rate_hz:.0f} samples per second", rate_hz >= MIN_RATE_HZ, advice)


def _check_losses(facts: SensorFacts) -> DeviceFinding:
    """Check the share of lost packets, and that the board did not restart."""
    packet_count = facts.packets + facts.lost
    value = (
        f"{facts.lost} of {packet_count} packets lost, torn or garbled, {facts.spoiled_bytes} bytes that were no packet"
    )
    advice = "Take a short cable and a USB port of the computer itself, no hub; end programs that keep it busy."
    if facts.restarts:
        value += f"; the board restarted {facts.restarts} times"
        advice = "The board loses its power, or its program crashes: check its cable, and flash it again."
    return _make_finding(
        "Sensor losses", value, not facts.restarts and facts.lost <= MAX_LOST_SHARE * packet_count, advice
    )


def _check_clock(facts: SensorFacts) -> DeviceFinding:
    """Check the drift of the sensor's clock and the longest delay of a packet; a warning where no clock was fitted."""
    if facts.drift_ppm is None or facts.longest_delay_s is None:
        advice = "Without it no sample can be put on a tick: close other programs that read this line, then try again."
        return _make_finding("Sensor clock", "it could not be fitted to this computer's", False, advice)
    rate_word = "slow" if facts.drift_ppm > 0 else "fast"
    delay_ms = 1000 * facts.longest_delay_s
    value = (
        f"{abs(facts.drift_ppm):.0f} ppm {rate_word} relative to this computer's; packets up to {delay_ms:.1f} ms late"
    )
    is_drifting = abs(facts.drift_ppm) > MAX_DRIFT_PPM
    advice = (
        "No quartz is that far off: check that the firmware's time stamps are in microseconds."
        if is_drifting
        else "This computer is busy: end other programs."
    )
    return _make_finding("Sensor clock", value, not is_drifting and facts.longest_delay_s <= MAX_DELAY_S, advice)


def _check_noise(noise_mps2: list[float]) -> DeviceFinding:
    """Check the noise of the three axes (m/s² rms); exactly zero means a channel without a signal, NaN no samples."""
    value = f"{', '.join(f'{axis_noise:.3f}' for axis_noise in noise_mps2)} m/s² rms at rest (x, y, z)"
    advice = (
        "Let go of the handle and check again. If the noise persists: check the sensor's capacitors, cable and supply."
    )
    if any(axis_noise == 0.0 for axis_noise in noise_mps2):
        value, advice = (
            f"{value}: a channel does not move at all",
            "Check its wire: it does not reach the board's input.",
        )
    return _make_finding(
        "Sensor noise", value, bool(min(noise_mps2) > 0.0 and max(noise_mps2) <= MAX_NOISE_MPS2), advice
    )


def _make_finding(name: str, value: str, is_ok: bool, advice: str) -> DeviceFinding:
    """Make a finding; a warning with advice unless `is_ok`."""
    return DeviceFinding(name, value, is_ok, "" if is_ok else advice, warning=not is_ok)
