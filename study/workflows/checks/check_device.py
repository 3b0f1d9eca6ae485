"""Check whether a device is fit for a sitting: kind, answers, position, accelerometer, sample rate and largest force.

The device is read for half a second (`LOOKS` readings) without any command. Limits without a stated source are
heuristic.
"""

import math

import numpy as np

from equalizer.signals.signal import FloatArray
from protocols.definition.apparatus import SafetySettings
from study.devices.clock import Clock
from study.devices.device import Device, DeviceInfo, Look
from study.session.stimulus.limits import forces_in_words
from study.session.views.views import DeviceFinding, DeviceReport

LOOKS = 50
"""Number of readings."""
EVERY_S = 0.01
"""Interval between two readings (s)."""

ENOUGH = 0.9
"""Fraction of the readings that must succeed; not all, because a busy computer is late now and then."""

FAR_MM = 20.0
"""Largest accepted distance (mm) of the handle from its place: there the centring spring of the shipped protocols pulls
with a few newtons."""

NOISY_MPS2 = 1.0
"""Largest accepted acceleration at rest (m/s², rms over the three axes). The noise of an accelerometer over 500 Hz is
about 0.1 m/s²; a trembling hand on the handle gives up to 0.5."""

RATE_HZ = 1000.0
"""Sample rate of the device's loop for which stimuli are made (Hz)."""

MM_PER_M = 1000.0


CENTRE_M = (0.0, 0.0, 0.0)
"""Place of the handle where none is given: the origin of the device's coordinates (m)."""


def check_device(
    device: Device,
    clock: Clock,
    place_m: tuple[float, float, float] = CENTRE_M,
    total_cap_n: float | None = None,
    safety: SafetySettings | None = None,
    with_sensor: bool = True,
) -> DeviceReport:
    """Findings about an idle device; takes `LOOKS` times `EVERY_S`. Commands no force; what is wrong is a finding, not
    an exception.

    place_m: where trials start. total_cap_n: the largest force that will be requested (N), if known. safety: limits of
    the forces, to be stated. with_sensor: False if the device was opened without its accelerometer, which is then not
    judged.
    """
    samples, info = [], device.info
    for _ in range(LOOKS):
        samples.append(device.look())
        clock.sleep(EVERY_S)
    answered = [look for look in samples if look.position_m is not None or look.acceleration_mps2 is not None]
    sensors = (_handle(answered, place_m),) if answered else ()
    if answered and with_sensor:
        sensors = (*sensors, _accelerometer(answered) if info.has_sensor else _no_accelerometer())
    largest = _largest_force(info, total_cap_n)
    made_of = (DeviceFinding("Force on a hand", forces_in_words(safety), fine=True),) if safety is not None else ()
    findings = (_check_kind(info), _answers(len(answered)), *sensors, _rate(info), largest, *made_of)
    return DeviceReport(info.name, info.simulated, findings)


def _check_kind(info: DeviceInfo) -> DeviceFinding:
    kind = "simulated: no handle moves" if info.simulated else "a real device"
    return DeviceFinding("Device", f"{info.name} ({kind})", fine=True)


def _answers(answered: int) -> DeviceFinding:
    fine = answered >= ENOUGH * LOOKS
    advice = "Check its power and its cable, then open it again."
    return DeviceFinding("Answers", f"{answered} of {LOOKS} times", fine, "" if fine else advice)


def _handle(samples: list[Look], place_m: tuple[float, float, float]) -> DeviceFinding:
    """Judge the distance of the mean position from the place; too few positions mean an uncalibrated device."""
    positions_m = [look.position_m for look in samples if look.position_m is not None]
    if len(positions_m) < ENOUGH * len(samples):
        advice = "Switch the device off and on, and calibrate it as its manual says."
        return DeviceFinding("Handle", "its position is no number", fine=False, advice=advice)
    away_mm = MM_PER_M * math.dist(np.mean(positions_m, axis=0), place_m)
    fine = away_mm <= FAR_MM
    advice = f"Bring the handle to within {FAR_MM:g} mm of its place."
    return DeviceFinding("Handle", f"{away_mm:.1f} mm from its place", fine, "" if fine else advice)


def _accelerometer(samples: list[Look]) -> DeviceFinding:
    readings = np.array([look.acceleration_mps2 for look in samples if look.acceleration_mps2 is not None])
    clipped = sum(look.sensor_clipped for look in samples)
    if len(readings) < ENOUGH * len(samples):
        return _accelerometer_problem("its reading is no number", "Check the sensor's cable and its power.")
    if clipped:
        return _accelerometer_problem(
            f"at its limit in {clipped} of {len(samples)} readings",
            "Lay the handle at rest. If that does not help, check the sensor's range, cable and mounting.",
        )
    return _noise(readings)


def _no_accelerometer() -> DeviceFinding:
    advice = "Trials run all the same; what the device delivers remains unknown. To add one, see `hapteq doctor`."
    return DeviceFinding("Accelerometer", "none is configured", fine=False, advice=advice, warning=True)


def _noise(readings_mps2: FloatArray) -> DeviceFinding:
    """Judge the accelerometer by the standard deviation of readings at rest. readings_mps2: (n, 3). A channel that
    never changes is not connected, because a working sensor has noise."""
    dead = [axis for axis, channel in zip("xyz", readings_mps2.T, strict=True) if np.ptp(channel) == 0.0]
    if dead:
        return _accelerometer_problem(
            f"always exactly the same along {' and '.join(dead)}",
            "The sensor is dead, or not plugged in: check its cable and its power.",
        )
    rms_mps2 = float(np.sqrt(readings_mps2.var(axis=0).sum()))
    if rms_mps2 > NOISY_MPS2:
        return _accelerometer_problem(
            f"{rms_mps2:.2f} m/s² rms at rest, more than {NOISY_MPS2:g}",
            "Let go of the handle and check again. If the noise persists, check the sensor's cable, shield and "
            "mounting.",
        )
    return DeviceFinding("Accelerometer", f"{rms_mps2:.2f} m/s² rms at rest", fine=True)


def _accelerometer_problem(value: str, advice: str) -> DeviceFinding:
    return DeviceFinding("Accelerometer", value, fine=False, advice=advice)


def _rate(info: DeviceInfo) -> DeviceFinding:
    fine = abs(info.sample_rate_hz - RATE_HZ) <= 0.01 * RATE_HZ
    advice = f"Stimuli are made for {RATE_HZ:g} Hz: set the device's loop to that."
    return DeviceFinding("Rate", f"{info.sample_rate_hz:g} Hz", fine, "" if fine else advice)


def _largest_force(info: DeviceInfo, total_cap_n: float | None) -> DeviceFinding:
    needed = "" if total_cap_n is None else f"; at most {total_cap_n:g} N will be commanded"
    fine = info.max_force_n > 0 and (total_cap_n is None or info.max_force_n >= total_cap_n)
    advice = "Lower total_cap_n in the protocol's [safety] section, or take a stronger device."
    return DeviceFinding("Largest force", f"{info.max_force_n:g} N{needed}", fine, "" if fine else advice)
