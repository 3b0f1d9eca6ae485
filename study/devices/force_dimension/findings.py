"""Findings of `hapteq doctor` about a Force Dimension device before a study day, and its calibration by hand (`doctor
--calibrate`). Commands only zero forces.

In this order: library, USB, real-time rights, accelerometer, connection, power, calibration, watchdog, masses, gravity
compensation, velocity. Each finding that is not fine states a remedy. Called by `study.devices.opening`.
"""

import contextlib
import time

from study.devices.accelerometer.sensor_findings import check_sensor
from study.devices.drive.real_time_class import check_real_time_rights
from study.devices.force_dimension.connect import CALIBRATION_ADVICE, load_library, make_ready, open_model
from study.devices.force_dimension.device_models import MODELS, DeviceModel
from study.devices.force_dimension.handle import Handle
from study.devices.force_dimension.lab import LabSettings, locate_lab_file, read_lab_settings
from study.devices.force_dimension.library import Library, LibraryError
from study.devices.force_dimension.open_rig import read_info
from study.devices.force_dimension.usb import PERMISSION_ADVICE, find_usb_devices
from study.devices.force_dimension.watchdog_check import check_watchdog
from study.errors import DeviceError
from study.session.views.participant_views import DeviceFinding

EXAMINATION_CAP_N = 1.0
"""Force cap (N) set in the library during the examination. Only zero forces are sent; the cap protects against an error
of this program. Chosen by hand."""

FREE_MOTION_S = 0.3
"""Time (s) for which the handle moves freely, gravity compensated, before its speed is measured. Chosen by hand."""
COMMAND_INTERVAL_S = 0.002
"""Interval (s) between zero forces, shorter than the device's watchdog time."""
VELOCITY_WINDOW_S = 0.02
"""Time (s), after `FREE_MOTION_S`, over which the velocity is computed from two positions. The library also averages
over 20 ms (`Handle.read_velocity_mps`)."""
DRIFT_LIMIT_MPS = 0.02
"""Speed (m/s) after `FREE_MOTION_S` above which the gravity compensation is reported as wrong: an acceleration of 0.07
m/s² (0.7 % of g) in excess of friction. Chosen by hand: friction holds the handle at a smaller error."""

POWER_ADVICE = "Switch its power supply on."
"""Advice for a device without power."""
SENSOR_TITLE = "Accelerometer"
"""Title of the findings on the accelerometer."""


def examine(name: str) -> tuple[DeviceFinding, ...]:
    """Examine a device: findings up to the first failure that prevents further checks. The checks of USB and real-time
    rights are made in any case, that of the accelerometer where the lab file can be read. name: a key of `MODELS`.
    A `DeviceError` becomes a finding; the device is disconnected and braked afterwards."""
    try:
        lab = read_lab_settings()
    except DeviceError as error:
        return (_make_failed_finding("Driver", error), *_check_usb(), check_real_time_rights())
    try:
        library = load_library()
    except DeviceError as error:
        return (
            _make_failed_finding("Driver", error),
            *(_check_usb() or _report_unplugged_device()),
            check_real_time_rights(),
            *_check_sensor(lab),
        )
    library_finding = DeviceFinding("Library", f"{library.path}, SDK {library.version_text}", fine=True)
    return (
        library_finding,
        *_check_usb(),
        check_real_time_rights(),
        *_check_sensor(lab),
        *_examine_device(library, MODELS[name], lab),
    )


def _examine_device(library: Library, model: DeviceModel, lab: LabSettings) -> list[DeviceFinding]:
    """Open the device, examine it, and disconnect it. `DeviceError` and `LibraryError` become findings."""
    findings: list[DeviceFinding] = []
    try:
        handle = open_model(library, model)
    except DeviceError as error:
        return [_make_failed_finding("Driver", error)]
    try:
        info = read_info(handle, library, model, lab.effective_mass_kg)
        findings.append(DeviceFinding("Connection", f"{info.name}, {info.details}", fine=True))
        findings += _examine_opened(handle, model, lab)
    except DeviceError as error:
        findings.append(_make_failed_finding("Driver", error))
    except LibraryError as error:
        advice = "Check its power and its cable, then try again."
        findings.append(DeviceFinding("Driver", f"the library says: {error}", fine=False, advice=advice))
    finally:
        handle.disconnect()
    return findings


def calibrate(name: str, timeout_s: float) -> None:
    """Calibrate the device: wait, for at most timeout_s (s), until a person has moved the handle to its rest position.
    name: a key of `MODELS`. Raises `DeviceError` where the device cannot be opened or is not calibrated in time."""
    handle = open_model(load_library(), MODELS[name])
    try:
        handle.calibrate(timeout_s)
    except LibraryError as error:
        raise DeviceError(
            "The device was not calibrated", f"Within {timeout_s:g} s the library said: {error}.", CALIBRATION_ADVICE
        ) from error
    finally:
        handle.disconnect()


def _check_usb() -> list[DeviceFinding]:
    """Check the USB permissions of the devices that are plugged in; empty without any, and on systems other than
    Linux."""
    return [
        DeviceFinding("USB", device.product, fine=True)
        if device.may_open
        else DeviceFinding(
            "USB", f"{device.product}: this account may not open it", fine=False, advice=PERMISSION_ADVICE
        )
        for device in find_usb_devices() or ()
    ]


def _report_unplugged_device() -> list[DeviceFinding]:
    """Report that no device is plugged in, for a computer without the vendor's library. Called where no device was
    found by USB; empty on systems other than Linux, where that is not known."""
    if find_usb_devices() is None:
        return []
    text, advice = "no device of the vendor is plugged in", "Plug its USB cable in and switch its power on."
    return [DeviceFinding("USB", text, fine=False, advice=advice, warning=True)]


def _check_sensor(lab: LabSettings) -> list[DeviceFinding]:
    """Check the accelerometer; a warning where none is configured. It is opened, read and closed again, because the
    process of the control loop opens it later."""
    if lab.accelerometer is None:
        advice = (
            "Without one no acceleration is measured. To add one: calibrate it with `hapteq doctor --calibrate-sensor "
            "PORT` and put the [accelerometer] table that this prints into that file (docs/hardware.md, The "
            "accelerometer)."
        )
        return [
            DeviceFinding(
                SENSOR_TITLE, f"none is configured in {locate_lab_file()}", fine=False, advice=advice, warning=True
            )
        ]
    try:
        with contextlib.closing(lab.accelerometer.open_sensor()) as sensor:
            return list(check_sensor(sensor))
    except DeviceError as error:
        return [_make_failed_finding(SENSOR_TITLE, error)]


def _examine_opened(handle: Handle, model: DeviceModel, lab: LabSettings) -> list[DeviceFinding]:
    """Examine an opened device: power and calibration and, with both, watchdog, masses and gravity compensation. Raises
    `DeviceError`, `LibraryError`."""
    status = handle.read_status()
    power_finding = DeviceFinding(
        "Power", "on" if status.powered else "off", status.powered, "" if status.powered else POWER_ADVICE
    )
    is_calibrated = status.calibrated
    calibration_text = (
        "done" if is_calibrated else "not done since it was switched on: it does not know where its handle is"
    )
    calibration_advice = (
        ""
        if is_calibrated
        else f"Run `hapteq doctor --device {_find_option_name(model)} --calibrate`, or: {CALIBRATION_ADVICE}"
    )
    findings = [power_finding, DeviceFinding("Calibration", calibration_text, is_calibrated, calibration_advice)]
    if not (status.powered and is_calibrated):
        return findings
    watchdog_s = make_ready(handle, model, EXAMINATION_CAP_N, lab.effector_mass_kg)
    release_s = check_watchdog(handle, watchdog_s, time.monotonic, time.sleep)
    watchdog_text = (
        f"set to {1000 * watchdog_s:.1f} ms; without forces the device let go within {1000 * release_s:.0f} ms"
    )
    return [
        *findings,
        DeviceFinding("Watchdog", watchdog_text, fine=True),
        _report_masses(model, lab),
        *_check_gravity(handle),
    ]


def _report_masses(model: DeviceModel, lab: LabSettings) -> DeviceFinding:
    """Report the masses in use (kg): for the gravity compensation, and for the stiffness of the centring spring."""
    effector_mass_kg = lab.effector_mass_kg or model.effector_mass_kg
    gravity_text = f"{effector_mass_kg:g} kg" if effector_mass_kg else "with the library's own mass"
    spring_text = (
        f"{lab.effective_mass_kg:g} kg" if lab.effective_mass_kg else f"{model.effective_mass_kg:g} kg, assumed"
    )
    return DeviceFinding(
        "Masses", f"gravity compensation {gravity_text}, spring {spring_text} ({locate_lab_file()})", fine=True
    )


def _check_gravity(handle: Handle) -> list[DeviceFinding]:
    """Check the vertical drift of the handle (z is up) by its positions, and whether the library's velocity agrees with
    it within `DRIFT_LIMIT_MPS` plus half of it; NaN does not agree. Empty where positions cannot be read, which
    `examine_setup` reports when it opens the device. Raises `LibraryError`."""
    _send_zero_forces(handle, FREE_MOTION_S)
    try:
        start_s, start_height_m = time.monotonic(), handle.read_position_m()[2]
        _send_zero_forces(handle, VELOCITY_WINDOW_S)
        upward_mps = (handle.read_position_m()[2] - start_height_m) / (time.monotonic() - start_s)
    except LibraryError as error:
        if error.function == "dhdGetPosition":
            return []
        raise
    library_mps = handle.read_velocity_mps()[2]
    findings = [_check_drift(upward_mps)]
    if not abs(library_mps - upward_mps) <= DRIFT_LIMIT_MPS + 0.5 * abs(upward_mps):
        text = (
            f"the library says {library_mps:g} m/s along z; by its positions the handle moves at {upward_mps:.2g} m/s"
        )
        advice = "Nothing that hapteq plays depends on it. Other programs may: install the vendor's newest SDK."
        findings.append(DeviceFinding("Velocity", text, fine=False, advice=advice, warning=True))
    return findings


def _send_zero_forces(handle: Handle, duration_s: float) -> None:
    """Send zero forces for duration_s (s): the library compensates gravity only while forces are sent. Raises
    `LibraryError`."""
    end_s = time.monotonic() + duration_s
    while time.monotonic() < end_s:
        handle.set_force(0.0, 0.0, 0.0)
        time.sleep(COMMAND_INTERVAL_S)


def _check_drift(upward_mps: float) -> DeviceFinding:
    """Judge the gravity compensation by the vertical speed of the free handle (m/s, > 0: it rises); at most a
    warning."""
    if abs(upward_mps) <= DRIFT_LIMIT_MPS:
        return DeviceFinding("Gravity", "compensated: the handle stays where it is", fine=True)
    is_sinking = upward_mps < 0
    advice = (
        f"With no hand on it, make effector_mass_kg in {locate_lab_file()} {'larger' if is_sinking else 'smaller'}."
    )
    direction = "sinks" if is_sinking else "rises"
    return DeviceFinding(
        "Gravity", f"the handle {direction} at {1000 * abs(upward_mps):.0f} mm/s", False, advice, warning=True
    )


def _find_option_name(model: DeviceModel) -> str:
    """Find the name of a model for the option `--device`: its key in `MODELS`."""
    return next(name for name, candidate in MODELS.items() if candidate is model)


def _make_failed_finding(name: str, error: DeviceError) -> DeviceFinding:
    """Convert an error to a finding, with its remedy as advice."""
    return DeviceFinding(name, f"{error.title}. {error.happened}", fine=False, advice=error.do_now)
