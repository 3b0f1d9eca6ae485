"""Check whether a device is fit for a session: kind, answers, position, accelerometer, sample rate, largest force.

The device is read for half a second (`READINGS` readings) without any command. Limits without a stated source are
heuristic.
"""

import math

import numpy as np

from equalizer.signals.signal import FloatArray
from protocols.definition.apparatus import SafetySettings
from study.devices.clock import Clock
from study.devices.device import Device, DeviceInfo, Look
from study.session.stimulus.limits import describe_forces
from study.session.views.views import DeviceFinding, DeviceReport

READINGS = 50
"""Number of readings."""
READING_INTERVAL_S = 0.01
"""Interval between two readings (s)."""

MIN_ANSWER_FRACTION = 0.9
"""Fraction of the readings that must succeed; below 1, because a busy computer is late now and then."""

MAX_DISTANCE_MM = 20.0
"""Largest accepted distance (mm) of the handle from its place: there the centring spring of the shipped protocols pulls
with a few newtons."""

MAX_NOISE_MPS2 = 1.0
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
    """Findings about an idle device; takes `READINGS` times `READING_INTERVAL_S`. Commands no force; what is wrong is a
    finding, not an exception.

    place_m: where trials start. total_cap_n: the largest force that will be requested (N), if known. safety: limits of
    the forces, to be stated. with_sensor: False if the device was opened without its accelerometer, which is then not
    judged.
    """
    looks, info = [], device.info
    for _ in range(READINGS):
        looks.append(device.look())
        clock.sleep(READING_INTERVAL_S)
    answered = [look for look in looks if look.position_m is not None or look.acceleration_mps2 is not None]
    sensor_findings = (_check_handle(answered, place_m),) if answered else ()
    if answered and with_sensor:
        sensor_findings = (
            *sensor_findings,
            _check_accelerometer(answered) if info.has_sensor else _report_no_accelerometer(),
        )
    force_finding = _check_largest_force(info, total_cap_n)
    force_findings = (
        (DeviceFinding("Force on a hand", describe_forces(safety), fine=True),) if safety is not None else ()
    )
    findings = (
        _check_kind(info),
        _check_answers(len(answered)),
        *sensor_findings,
        _check_rate(info),
        force_finding,
        *force_findings,
    )
    return DeviceReport(info.name, info.simulated, findings)


def _check_kind(info: DeviceInfo) -> DeviceFinding:
    """State the device's name and whether it is simulated; always passed."""
    kind = "simulated: no handle moves" if info.simulated else "a real device"
    return DeviceFinding("Device", f"{info.name} ({kind})", fine=True)


def _check_answers(answered: int) -> DeviceFinding:
    """Judge the number of successful readings out of `READINGS`."""
    fine = answered >= MIN_ANSWER_FRACTION * READINGS
    advice = "Check its power and its cable, then open it again."
    return DeviceFinding("Answers", f"{answered} of {READINGS} times", fine, "" if fine else advice)


def _check_handle(samples: list[Look], place_m: tuple[float, float, float]) -> DeviceFinding:
    """Judge the distance of the mean position from the place; too few positions mean an uncalibrated device."""
    positions_m = [look.position_m for look in samples if look.position_m is not None]
    if len(positions_m) < MIN_ANSWER_FRACTION * len(samples):
        advice = "Switch the device off and on, and calibrate it as its manual says."
        return DeviceFinding("Handle", "its position is no number", fine=False, advice=advice)
    distance_mm = MM_PER_M * math.dist(np.mean(positions_m, axis=0), place_m)
    fine = distance_mm <= MAX_DISTANCE_MM
    advice = f"Bring the handle to within {MAX_DISTANCE_MM:g} mm of its place."
    return DeviceFinding("Handle", f"{distance_mm:.1f} mm from its place", fine, "" if fine else advice)


def _check_accelerometer(samples: list[Look]) -> DeviceFinding:
    """Judge the accelerometer: valid readings, none at the limit of the range, and noise."""
    readings = np.array([look.acceleration_mps2 for look in samples if look.acceleration_mps2 is not None])
    clipped = sum(look.sensor_clipped for look in samples)
    if len(readings) < MIN_ANSWER_FRACTION * len(samples):
        return _report_accelerometer_problem("its reading is no number", "Check the sensor's cable and its power.")
    if clipped:
        return _report_accelerometer_problem(
            f"at its limit in {clipped} of {len(samples)} readings",
            "Lay the handle at rest. If that does not help, check the sensor's range, cable and mounting.",
        )
    return _check_noise(readings)


def _report_no_accelerometer() -> DeviceFinding:
    """Warn of a device without accelerometer."""
    advice = "Trials run all the same; what the device delivers remains unknown. To add one, see `hapteq doctor`."
    return DeviceFinding("Accelerometer", "none is configured", fine=False, advice=advice, warning=True)


def _check_noise(readings_mps2: FloatArray) -> DeviceFinding:
    """Judge the accelerometer by the standard deviation of readings at rest. readings_mps2: (n, 3). A channel that
    never changes is not connected, because a working sensor has noise."""
    dead_axes = [axis for axis, channel in zip("xyz", readings_mps2.T, strict=True) if np.ptp(channel) == 0.0]
    if dead_axes:
        return _report_accelerometer_problem(
            f"always exactly the same along {' and '.join(dead_axes)}",
            "The sensor is dead, or not plugged in: check its cable and its power.",
        )
    rms_mps2 = float(np.sqrt(readings_mps2.var(axis=0).sum()))
    if rms_mps2 > MAX_NOISE_MPS2:
        return _report_accelerometer_problem(
            f"{rms_mps2:.2f} m/s² rms at rest, more than {MAX_NOISE_MPS2:g}",
            "Let go of the handle and check again. If the noise persists, check the sensor's cable, shield and "
            "mounting.",
        )
    return DeviceFinding("Accelerometer", f"{rms_mps2:.2f} m/s² rms at rest", fine=True)


def _report_accelerometer_problem(value: str, advice: str) -> DeviceFinding:
    return DeviceFinding("Accelerometer", value, fine=False, advice=advice)


def _check_rate(info: DeviceInfo) -> DeviceFinding:
    """Judge the sample rate; accepted within 1 % of `RATE_HZ`."""
    fine = abs(info.sample_rate_hz - RATE_HZ) <= 0.01 * RATE_HZ
    advice = f"Stimuli are made for {RATE_HZ:g} Hz: set the device's loop to that."
    return DeviceFinding("Rate", f"{info.sample_rate_hz:g} Hz", fine, "" if fine else advice)


def _check_largest_force(info: DeviceInfo, total_cap_n: float | None) -> DeviceFinding:
    """Judge whether the device can give the largest force that will be commanded (N)."""
    cap_text = "" if total_cap_n is None else f"; at most {total_cap_n:g} N will be commanded"
    fine = info.max_force_n > 0 and (total_cap_n is None or info.max_force_n >= total_cap_n)
    advice = "Lower total_cap_n in the protocol's [safety] section, or take a stronger device."
    return DeviceFinding("Largest force", f"{info.max_force_n:g} N{cap_text}", fine, "" if fine else advice)
