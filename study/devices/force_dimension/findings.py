"""Findings of `hapteq doctor` about a Force Dimension device before a study day. Commands only zero forces.

In this order: library, USB, real-time rights, accelerometer, connection, power, calibration, watchdog, masses, gravity
compensation. Each finding that is not fine says what to do.
"""

import contextlib
import time

from study.devices.accelerometer.sensor_findings import check_sensor
from study.devices.drive.real_time_class import check_real_time_rights
from study.devices.force_dimension.connect import CALIBRATION_ADVICE, load_library, make_ready, open_model
from study.devices.force_dimension.device_models import MODELS, DeviceModel
from study.devices.force_dimension.handle import Handle
from study.devices.force_dimension.lab import LabSettings, locate_lab_file, read_lab
from study.devices.force_dimension.library import Library, LibraryError
from study.devices.force_dimension.rigs import read_info
from study.devices.force_dimension.usb import PERMISSION_ADVICE, find_usb_devices
from study.devices.force_dimension.watchdog_check import check_watchdog
from study.errors import DeviceError
from study.session.views.participant_views import DeviceFinding

CAP_N = 1.0
"""Force cap set in the library during the examination (N). Only zero forces are sent; the cap protects against an error
of this program."""

AT_REST_S = 0.3
"""Time (s) for which the handle is left to itself, gravity compensated, before its speed is read."""
EVERY_S = 0.002
"""Interval (s) of the zero forces sent meanwhile, shorter than the device's watchdog."""
COMPARED_S = 0.02
"""Time (s), after `AT_REST_S`, over which the velocity is computed from two positions. The library averages over 20 ms
too (`Handle.read_velocity_mps`)."""
DRIFTING_MPS = 0.02
"""Speed (m/s) after `AT_REST_S` above which the gravity compensation is off: an acceleration of 0.07 m/s² (0.7 % of g)
in excess of friction. A smaller error is held by friction."""

POWER = "Switch its power supply on."
"""Advice for a device without power."""
SENSOR = "Accelerometer"
"""Title of the findings on the accelerometer."""


def examine(name: str) -> tuple[DeviceFinding, ...]:
    """Findings up to the first failure that prevents the further checks; checks that need no library are made in any
    case. name: a key of `MODELS`. Raises no `DeviceError`; the device is left braked."""
    try:
        lab = read_lab()
    except DeviceError as error:
        return (_make_failed_finding("Driver", error), *_check_usb(), check_real_time_rights())
    try:
        library = load_library()
    except DeviceError as error:
        return (
            _make_failed_finding("Driver", error),
            *(_check_usb() or _find_if_unplugged()),
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
    """Open the device, examine it, and disconnect it. Errors become findings."""
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


def calibrate(name: str, patience_s: float) -> None:
    """Calibrate the device: wait, for patience_s (s) at most, until a person has put the handle to its rest position.
    Raises `DeviceError`."""
    handle = open_model(load_library(), MODELS[name])
    try:
        handle.calibrate(patience_s)
    except LibraryError as error:
        raise DeviceError(
            "The device was not calibrated", f"Within {patience_s:g} s the library said: {error}.", CALIBRATION_ADVICE
        ) from error
    finally:
        handle.disconnect()


def _check_usb() -> list[DeviceFinding]:
    """Findings on the USB permissions of the devices that are plugged in; empty on systems other than Linux."""
    return [
        DeviceFinding("USB", device.product, fine=True)
        if device.may_open
        else DeviceFinding(
            "USB", f"{device.product}: this account may not open it", fine=False, advice=PERMISSION_ADVICE
        )
        for device in find_usb_devices() or ()
    ]


def _find_if_unplugged() -> list[DeviceFinding]:
    """Finding that no device is plugged in, for a computer without the vendor's library. Called where no device was
    found by USB; empty on systems other than Linux, where that is not known."""
    if find_usb_devices() is None:
        return []
    value, advice = "no device of the vendor is plugged in", "Plug its USB cable in and switch its power on."
    return [DeviceFinding("USB", value, fine=False, advice=advice, warning=True)]


def _check_sensor(lab: LabSettings) -> list[DeviceFinding]:
    """Findings on the accelerometer. It is opened, read and closed again, because the loop's process opens it
    itself."""
    if lab.accelerometer is None:
        advice = (
            "Without one no acceleration is measured. To add one: calibrate it with `hapteq doctor --calibrate-sensor "
            "PORT` and put the [accelerometer] table that this prints into that file (docs/hardware.md, The "
            "accelerometer)."
        )
        return [
            DeviceFinding(SENSOR, f"none is configured in {locate_lab_file()}", fine=False, advice=advice, warning=True)
        ]
    try:
        with contextlib.closing(lab.accelerometer.open_sensor()) as sensor:
            return list(check_sensor(sensor))
    except DeviceError as error:
        return [_make_failed_finding(SENSOR, error)]


def _examine_opened(handle: Handle, model: DeviceModel, lab: LabSettings) -> list[DeviceFinding]:
    """Findings on an opened device: power, calibration, watchdog, masses, gravity compensation. Raises `DeviceError`,
    `LibraryError`."""
    status = handle.read_status()
    power = DeviceFinding("Power", "on" if status.powered else "off", status.powered, "" if status.powered else POWER)
    calibrated = status.calibrated
    calibration_text = (
        "done" if calibrated else "not done since it was switched on: it does not know where its handle is"
    )
    advice = (
        ""
        if calibrated
        else f"Run `hapteq doctor --device {_find_option_name(model)} --calibrate`, or: {CALIBRATION_ADVICE}"
    )
    findings = [power, DeviceFinding("Calibration", calibration_text, calibrated, advice)]
    if not (status.powered and calibrated):
        return findings
    drops_after_s = make_ready(handle, model, CAP_N, lab.effector_mass_kg)
    release_s = check_watchdog(handle, drops_after_s, time.monotonic, time.sleep)
    watchdog = (
        f"set to {1000 * drops_after_s:.1f} ms; without forces the device let go within {1000 * release_s:.0f} ms"
    )
    return [
        *findings,
        DeviceFinding("Watchdog", watchdog, fine=True),
        _report_masses(model, lab),
        *_check_gravity(handle),
    ]


def _report_masses(model: DeviceModel, lab: LabSettings) -> DeviceFinding:
    """The masses in use (kg): for the gravity compensation, and for the stiffness of the centring spring."""
    effector_mass_kg = lab.effector_mass_kg or model.effector_mass_kg
    gravity_mass = f"{effector_mass_kg:g} kg" if effector_mass_kg else "with the library's own mass"
    spring_mass = (
        f"{lab.effective_mass_kg:g} kg" if lab.effective_mass_kg else f"{model.effective_mass_kg:g} kg, assumed"
    )
    return DeviceFinding(
        "Masses", f"gravity compensation {gravity_mass}, spring {spring_mass} ({locate_lab_file()})", fine=True
    )


def _check_gravity(handle: Handle) -> list[DeviceFinding]:
    """Findings on the vertical drift of the handle by its positions, and on a velocity of the library that differs from
    it; empty where positions cannot be read, which another finding reports. Raises `LibraryError`."""
    _send_zero_forces(handle, AT_REST_S)
    try:
        began_s, from_m = time.monotonic(), handle.read_position_m()[2]
        _send_zero_forces(handle, COMPARED_S)
        up_mps = (handle.read_position_m()[2] - from_m) / (time.monotonic() - began_s)
    except LibraryError as error:
        if error.function == "dhdGetPosition":
            return []
        raise
    reported_mps = handle.read_velocity_mps()[2]
    findings = [_check_drift(up_mps)]
    if not abs(reported_mps - up_mps) <= DRIFTING_MPS + 0.5 * abs(up_mps):
        value = f"the library says {reported_mps:g} m/s along z; by its positions the handle moves at {up_mps:.2g} m/s"
        advice = "Nothing that hapteq plays depends on it. Other programs may: install the vendor's newest SDK."
        findings.append(DeviceFinding("Velocity", value, fine=False, advice=advice, warning=True))
    return findings


def _send_zero_forces(handle: Handle, seconds: float) -> None:
    """Send zero forces for this time (s): the library compensates gravity only while forces are sent. Raises
    `LibraryError`."""
    until_s = time.monotonic() + seconds
    while time.monotonic() < until_s:
        handle.set_force(0.0, 0.0, 0.0)
        time.sleep(EVERY_S)


def _check_drift(up_mps: float) -> DeviceFinding:
    """Finding on the gravity compensation by the vertical speed of the free handle (m/s, > 0: it rises)."""
    if abs(up_mps) <= DRIFTING_MPS:
        return DeviceFinding("Gravity", "compensated: the handle stays where it is", fine=True)
    is_sinking = up_mps < 0
    advice = (
        f"With no hand on it, make effector_mass_kg in {locate_lab_file()} {'larger' if is_sinking else 'smaller'}."
    )
    direction = "sinks" if is_sinking else "rises"
    return DeviceFinding(
        "Gravity", f"the handle {direction} at {1000 * abs(up_mps):.0f} mm/s", False, advice, warning=True
    )


def _find_option_name(model: DeviceModel) -> str:
    """The name that `--device` takes for a model."""
    return next(name for name, candidate in MODELS.items() if candidate is model)


def _make_failed_finding(name: str, error: DeviceError) -> DeviceFinding:
    """An error as a finding, with its remedy as advice."""
    return DeviceFinding(name, f"{error.title}. {error.happened}", fine=False, advice=error.do_now)
