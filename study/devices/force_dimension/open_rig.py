"""Open a Force Dimension device by name and make it ready for a study.

Order: load the vendor's library, open the accelerometer and the device, check its identity and, for a hand on the
handle, its acceptance; set force limit, gravity compensation and watchdog; test the watchdog.
"""

import math
import time
from dataclasses import replace
from datetime import UTC, datetime

from study.devices.accelerometer.sensor import Accelerometer
from study.devices.device import DeviceInfo, DeviceSettings
from study.devices.force_dimension.acceptance import check_accepted
from study.devices.force_dimension.connect import load_library, make_device_error, make_ready, open_model
from study.devices.force_dimension.device_models import MODELS, DeviceModel
from study.devices.force_dimension.handle import UNKNOWN_SERIAL, Handle
from study.devices.force_dimension.lab import LabSettings, read_lab_settings
from study.devices.force_dimension.library import Library, LibraryError
from study.devices.force_dimension.rig import ForceDimensionRig
from study.devices.force_dimension.watchdog_check import check_watchdog
from study.errors import DeviceError

LOOP_RATE_HZ = 1000.0
"""Rate of the force loop (Hz), and of its samples. Chosen: the usual rate of haptic control."""


def open_force_dimension_rig(name: str, settings: DeviceSettings) -> ForceDimensionRig:
    """Open a device of the vendor by the key of its model in `MODELS`, and its accelerometer where one is configured
    and `settings.with_sensor` is true. Raises `DeviceError` with the reason; device and accelerometer are then stopped
    and closed."""
    model, lab = MODELS[name], read_lab_settings()
    library = load_library()
    sensor = lab.accelerometer.open_sensor() if lab.accelerometer is not None and settings.with_sensor else None
    try:
        return _make_rig(library, model, lab, sensor, settings)
    except BaseException:
        if sensor is not None:
            sensor.close()
        raise


def _make_rig(
    library: Library,
    model: DeviceModel,
    lab: LabSettings,
    sensor: Accelerometer | None,
    settings: DeviceSettings,
) -> ForceDimensionRig:
    """Open the device and make it ready; with a hand on the handle only if it was accepted. sensor: None without an
    accelerometer. After any error the device is disconnected. Raises `DeviceError`."""
    handle = open_model(library, model)
    try:
        info = replace(read_info(handle, library, model, lab.effective_mass_kg), has_sensor=sensor is not None)
        if settings.hand_on_handle:
            check_accepted(info, datetime.now(UTC).date())
        cap_n = min(settings.limits.total_cap_n, model.max_force_n)
        watchdog_s = make_ready(handle, model, cap_n, lab.effector_mass_kg)
        if watchdog_s > 0:  # 0: the device has no watchdog
            check_watchdog(handle, watchdog_s, time.monotonic, time.sleep)
        return ForceDimensionRig(handle, info, watchdog_s, cap_n, sensor)
    except LibraryError as error:
        handle.disconnect()
        raise make_device_error(model.name, error) from error
    except BaseException:
        handle.disconnect()
        raise


def read_info(handle: Handle, library: Library, model: DeviceModel, effective_mass_kg: float | None) -> DeviceInfo:
    """Read the properties of an open device, with `has_sensor` at its default. effective_mass_kg: from the laboratory's
    settings; None for the model's. Raises `LibraryError`, and `DeviceError` without a firmware or serial number: an
    acceptance holds for one device only, and could not be assigned."""
    firmware, serial = handle.read_firmware_version(), handle.read_serial_number()
    if not 0 < firmware < math.inf:
        raise _make_unknown_property_error(model, "firmware", f"gives {firmware:g} as the version")
    if serial == UNKNOWN_SERIAL:
        raise _make_unknown_property_error(model, "serial number", "answers and gives none")
    return DeviceInfo(
        name=model.name,
        simulated=False,
        sample_rate_hz=LOOP_RATE_HZ,
        max_force_n=model.max_force_n,
        effective_mass_kg=effective_mass_kg or model.effective_mass_kg,
        details=f"serial {serial}, firmware {firmware:g}, SDK {library.version_text}",
    )


def _make_unknown_property_error(model: DeviceModel, property_name: str, library_answer: str) -> DeviceError:
    """Make the error for a property that the device does not report. property_name: such as "firmware";
    library_answer: predicate of "Its library" that states what it returned instead."""
    return DeviceError(
        f"The {model.name} does not report its {property_name}",
        f"Its library {library_answer}, so no acceptance can be known to hold for it. Nothing has moved.",
        "Switch the device off and on, then try again; else install the vendor's newest SDK or firmware.",
    )
