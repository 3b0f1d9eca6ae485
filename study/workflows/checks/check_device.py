"""Check whether a device is fit for a session: kind, readings, position, accelerometer, sample rate, largest force.

The idle device is read for half a second; no force is commanded. Limits without a stated source are heuristic.
"""

import math

import numpy as np

from equalizer.signals.signal import FloatArray
from protocols.definition.apparatus import SafetySettings
from protocols.definition.new_use import NOMINAL_RATE_HZ
from study.devices.clock import Clock
from study.devices.device import Device, DeviceInfo, Look
from study.session.stimulus.limits import describe_forces
from study.session.views.participant_views import DeviceFinding, DeviceReport

READING_COUNT = 50
"""Number of readings. Chosen: enough for a mean position and a noise level, within half a second."""
READING_INTERVAL_S = 0.01
"""Interval between two readings (s). Chosen: ten ticks at 1 kHz, so that every reading is a new one."""

MIN_ANSWER_FRACTION = 0.9
"""Smallest accepted fraction of valid readings (with a position or an acceleration); also, of the valid readings, of
those with a position and of those with an acceleration. Chosen below 1, because a busy computer occasionally misses
one."""

MAX_DISTANCE_MM = 20.0
"""Largest accepted distance of the handle from the place where trials start (mm). Chosen."""

MAX_NOISE_MPS2 = 1.0
"""Largest accepted acceleration at rest (m/s², root of the summed variances of the three axes). Chosen above the
typical noise of an accelerometer over 500 Hz, about 0.1 m/s², and the tremor of a hand on the handle, up to 0.5."""

MM_PER_M = 1000.0

ORIGIN_M = (0.0, 0.0, 0.0)
"""Place where trials start if none is given: the origin of the device's coordinates (m)."""


def check_device(
    device: Device,
    clock: Clock,
    place_m: tuple[float, float, float] = ORIGIN_M,
    total_cap_n: float | None = None,
    safety: SafetySettings | None = None,
    with_sensor: bool = True,
) -> DeviceReport:
    """Check an idle device, and return a finding for each property that can be judged: position and accelerometer only
    if a reading is valid. Faults are findings, not exceptions.

    place_m: position (x, y, z) where trials start (m). total_cap_n: largest force that will be commanded (N); None:
    unknown. safety: force limits for the finding that states them; None: no such finding. with_sensor: False if the
    device was opened without its accelerometer, which is then not judged.
    """
    readings, info = [], device.info
    for _ in range(READING_COUNT):
        readings.append(device.look())
        clock.sleep(READING_INTERVAL_S)
    valid_readings = [
        reading for reading in readings if reading.position_m is not None or reading.acceleration_mps2 is not None
    ]
    sensor_findings = (_check_handle(valid_readings, place_m),) if valid_readings else ()
    if valid_readings and with_sensor:
        sensor_findings = (
            *sensor_findings,
            _check_accelerometer(valid_readings) if info.has_sensor else _report_no_accelerometer(),
        )
    force_finding = _check_largest_force(info, total_cap_n)
    force_findings = (
        (DeviceFinding("Force on a hand", describe_forces(safety), fine=True),) if safety is not None else ()
    )
    findings = (
        DeviceFinding(
            "Device", f"{info.name} ({'simulated: no handle moves' if info.simulated else 'a real device'})", fine=True
        ),
        _check_answers(len(valid_readings)),
        *sensor_findings,
        _check_rate(info),
        force_finding,
        *force_findings,
    )
    return DeviceReport(info.name, info.simulated, findings)


def _check_answers(valid_count: int) -> DeviceFinding:
    """Judge the number of valid readings out of `READING_COUNT`; fine from `MIN_ANSWER_FRACTION` on."""
    fine = valid_count >= MIN_ANSWER_FRACTION * READING_COUNT
    advice = "Check its power and its cable, then open it again."
    return DeviceFinding("Answers", f"{valid_count} of {READING_COUNT} times", fine, "" if fine else advice)


def _check_handle(valid_readings: list[Look], place_m: tuple[float, float, float]) -> DeviceFinding:
    """Judge the distance of the mean position from the place where trials start (x, y, z; m), at most
    `MAX_DISTANCE_MM`; too few positions indicate an uncalibrated device."""
    positions_m = [reading.position_m for reading in valid_readings if reading.position_m is not None]
    if len(positions_m) < MIN_ANSWER_FRACTION * len(valid_readings):
        advice = "Switch the device off and on, and calibrate it as its manual says."
        return DeviceFinding("Handle", "its position is no number", fine=False, advice=advice)
    distance_mm = MM_PER_M * math.dist(np.mean(positions_m, axis=0), place_m)
    fine = distance_mm <= MAX_DISTANCE_MM
    advice = f"Bring the handle to within {MAX_DISTANCE_MM:g} mm of its place."
    return DeviceFinding("Handle", f"{distance_mm:.1f} mm from its place", fine, "" if fine else advice)


def _check_accelerometer(valid_readings: list[Look]) -> DeviceFinding:
    """Judge the accelerometer: enough valid readings, none at the limit of the range, and the noise."""
    accelerations_mps2 = np.array(
        [reading.acceleration_mps2 for reading in valid_readings if reading.acceleration_mps2 is not None]
    )
    clipped_count = sum(reading.sensor_clipped for reading in valid_readings)
    if len(accelerations_mps2) < MIN_ANSWER_FRACTION * len(valid_readings):
        return _report_accelerometer_problem("its reading is no number", "Check the sensor's cable and its power.")
    if clipped_count:
        return _report_accelerometer_problem(
            f"at its limit in {clipped_count} of {len(valid_readings)} readings",
            "Lay the handle at rest. If that does not help, check the sensor's range, cable and mounting.",
        )
    return _check_noise(accelerations_mps2)


def _report_no_accelerometer() -> DeviceFinding:
    """Make the warning about a device without accelerometer."""
    advice = "Trials run all the same; what the device delivers remains unknown. To add one, see `hapteq doctor`."
    return DeviceFinding("Accelerometer", "none is configured", fine=False, advice=advice, warning=True)


def _check_noise(accelerations_mps2: FloatArray) -> DeviceFinding:
    """Judge the noise of the accelerometer at rest: the square root of the sum of the variances of the axes.
    accelerations_mps2: (n, 3), n >= 1. A channel that never changes is dead, because a working sensor has noise."""
    dead_axes = [axis for axis, channel in zip("xyz", accelerations_mps2.T, strict=True) if np.ptp(channel) == 0.0]
    if dead_axes:
        return _report_accelerometer_problem(
            f"always exactly the same along {' and '.join(dead_axes)}",
            "The sensor is dead, or not plugged in: check its cable and its power.",
        )
    rms_mps2 = float(np.sqrt(accelerations_mps2.var(axis=0).sum()))
    if rms_mps2 > MAX_NOISE_MPS2:
        return _report_accelerometer_problem(
            f"{rms_mps2:.2f} m/s² rms at rest, more than {MAX_NOISE_MPS2:g}",
            "Let go of the handle and check again. If the noise persists, check the sensor's cable, shield and "
            "mounting.",
        )
    return DeviceFinding("Accelerometer", f"{rms_mps2:.2f} m/s² rms at rest", fine=True)


def _report_accelerometer_problem(problem_text: str, advice: str) -> DeviceFinding:
    """Make the finding of a faulty accelerometer. problem_text: the fault in words."""
    return DeviceFinding("Accelerometer", problem_text, fine=False, advice=advice)


def _check_rate(info: DeviceInfo) -> DeviceFinding:
    """Judge the sample rate; fine within 1 % of `NOMINAL_RATE_HZ`, inclusive."""
    fine = abs(info.sample_rate_hz - NOMINAL_RATE_HZ) <= 0.01 * NOMINAL_RATE_HZ
    advice = f"Stimuli are made for {NOMINAL_RATE_HZ:g} Hz: set the device's loop to that."
    return DeviceFinding("Rate", f"{info.sample_rate_hz:g} Hz", fine, "" if fine else advice)


def _check_largest_force(info: DeviceInfo, total_cap_n: float | None) -> DeviceFinding:
    """Judge whether the device can exert the largest force that will be commanded, `total_cap_n` (N); None: any force
    above 0."""
    cap_text = "" if total_cap_n is None else f"; at most {total_cap_n:g} N will be commanded"
    fine = info.max_force_n > 0 and (total_cap_n is None or info.max_force_n >= total_cap_n)
    advice = "Lower total_cap_n in the protocol's [safety] section, or take a stronger device."
    return DeviceFinding("Largest force", f"{info.max_force_n:g} N{cap_text}", fine, "" if fine else advice)
