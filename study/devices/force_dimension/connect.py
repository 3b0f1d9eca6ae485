"""Connect to a Force Dimension device: open it, check power and calibration, arm the watchdog, enable forces.

Each failure is a `DeviceError` that states the cause and the remedy. If opening fails, the device is closed again;
after `open_model`, closing is the caller's task. Called by `open_rig` (sessions), `findings` (`hapteq doctor`) and
`linkage`.
"""

import contextlib
import os
import threading
from concurrent.futures import Future, InvalidStateError

from study.devices.force_dimension.device_models import DeviceModel, find_model_key
from study.devices.force_dimension.handle import Handle
from study.devices.force_dimension.library import DEVICE_IN_USE, Library, LibraryError
from study.devices.force_dimension.locate_library import (
    Computer,
    describe_this_computer,
    find_library,
    list_library_patterns,
)
from study.devices.force_dimension.usb import PERMISSION_ADVICE, find_usb_devices
from study.errors import DeviceError

WATCHDOG_S = 0.03
"""Timeout of the device's watchdog (s), close to the longest that the firmware can count (31.9 ms). A loop in Python is
late by 10 ms on a busy computer; a force that remains for 30 ms moves a handle without a hand by a few millimetres."""

MAX_DEVICES = 16
"""Largest number of devices that are opened in the search for a model: limits the search where the library returns a
wrong count. Chosen. Where the library counts more, the error for a device that was not found states both numbers."""

OPENING_TIMEOUT_S = 20.0
"""Longest time (s) that the library may take to open a device: several times as long as any takes. Chosen."""

CALIBRATION_ADVICE = (
    "Push the handle gently into its calibration position, as the device's manual shows (or run the vendor's "
    "calibration program), then try again."
)
"""Advice to the user for a device without calibration."""


def load_library() -> Library:
    """Load the vendor's library. Raises `DeviceError` where it is missing, cannot be loaded or is too old."""
    computer = describe_this_computer(os.environ)
    path = find_library(computer)
    if path is None:
        raise make_missing_library_error(computer)
    return Library(path)


def open_model(library: Library, model: DeviceModel) -> Handle:
    """Open the first free device of this model; its watchdog is not armed and its forces are not enabled yet. Devices
    of other models are closed again. Raises `DeviceError` where there is none, or one hangs while it is opened."""
    other_devices: list[tuple[str, str | None]] = []
    failures: list[LibraryError] = []
    device_count = max(0, int(library.get_function("dhdGetDeviceCount")()))
    for device_index in range(min(MAX_DEVICES, device_count)):
        try:
            handle = _open_in_time(library, device_index)
        except LibraryError as error:
            failures.append(error)
            continue
        try:
            system_type = handle.read_system_type()
            if system_type in model.system_types:
                return handle
            other_devices.append((handle.read_system_name(), find_model_key(system_type)))
        except LibraryError as error:
            failures.append(error)
        except BaseException:
            handle.disconnect()
            raise
        handle.disconnect()
    missing_error = _make_missing_device_error(model, other_devices, failures)
    if device_count <= MAX_DEVICES:
        raise missing_error
    count_text = f"The library counts {device_count} devices, of which the first {MAX_DEVICES} were looked at."
    raise DeviceError(missing_error.title, f"{missing_error.happened} {count_text}", missing_error.do_now)


def _open_in_time(library: Library, device_index: int) -> Handle:
    """Open a device in a thread of its own, so that a USB transfer that hangs does not block this thread. A device that
    opens too late, or after an interruption, is closed again. Raises `LibraryError`, and `DeviceError` after
    `OPENING_TIMEOUT_S`."""
    opened: Future[int] = Future()

    def open_device() -> None:
        """Open the device, and close it again where the wait has ended. The function of the thread."""
        try:
            number = library.call("dhdOpenID", device_index)
        except BaseException as error:  # noqa: BLE001 - raised where it is awaited
            with contextlib.suppress(InvalidStateError):
                opened.set_exception(error)
            return
        try:
            opened.set_result(number)
        except InvalidStateError:
            Handle(library, number).disconnect()

    threading.Thread(target=open_device, name="dhdOpenID", daemon=True).start()
    try:
        return Handle(library, opened.result(OPENING_TIMEOUT_S))
    except BaseException as error:
        if not opened.cancel() and opened.exception() is None:  # it has just been opened
            Handle(library, opened.result()).disconnect()
        if not isinstance(error, TimeoutError):
            raise
        raise DeviceError(
            "The device does not answer",
            f"The vendor's library did not open its device number {device_index + 1} within "
            f"{OPENING_TIMEOUT_S:g} s: its USB connection hangs.",
            "Unplug its USB cable, switch it off and on, plug it in again, then try again.",
        ) from error


def make_ready(handle: Handle, model: DeviceModel, cap_n: float, effector_mass_kg: float | None) -> float:
    """Enable forces up to cap_n (N), starting with zero. Returns the watchdog's timeout (s): how long the device holds
    a force without commands; 0: without limit. effector_mass_kg: for the gravity compensation, None = the model's or,
    where that is None, the library's. Raises `DeviceError` for a device without power or calibration, or that does not
    switch its forces on, and for a failed call of the library. The caller has to disconnect it then."""
    try:
        _check_power_and_calibration(handle, model)
        handle.disable_time_guard()
        watchdog_s = handle.arm_watchdog(WATCHDOG_S)
        handle.limit_force(cap_n)
        handle.compensate_gravity(effector_mass_kg if effector_mass_kg is not None else model.effector_mass_kg)
        handle.enable_force()
        status = handle.read_status()
        if not status.gives_forces:
            raise DeviceError(
                f"The {model.name} accepts no forces",
                f"It was told to switch its motors on, but they stay off: {status.off_reason}.",
                "Check that its power supply is on, and press its force button if it has one.",
            )
    except LibraryError as error:
        raise make_device_error(model.name, error) from error
    return watchdog_s


def make_device_error(name: str, error: LibraryError) -> DeviceError:
    """Error for a failed call of the vendor's library. name: name of the device."""
    return DeviceError(
        f"The {name} does not work", f"The library says: {error}.", "Check its power and its cable, then try again."
    )


def make_missing_library_error(computer: Computer) -> DeviceError:
    """Error for a computer on which the vendor's library is not found; it lists the folders that were searched, if
    any."""
    searched_folders = list(dict.fromkeys(str(folder) for folder, _ in list_library_patterns(computer)))
    return DeviceError(
        "The device's library is not installed",
        f"Neither libdrd nor libdhd was found in {', '.join(searched_folders)}."
        if searched_folders
        else "Neither drd64.dll nor dhd64.dll was found.",
        "Install the Force Dimension SDK from forcedimension.com, and set FDSDK to its folder.",
    )


def _check_power_and_calibration(handle: Handle, model: DeviceModel) -> None:
    """Require power and calibration. Raises `DeviceError` where one is missing, or `LibraryError`."""
    status = handle.read_status()
    if not status.powered:
        raise DeviceError(
            f"The {model.name} has no power",
            "It answers over USB, and its motors are off.",
            "Switch its power supply on, then try again.",
        )
    if not status.calibrated:
        raise DeviceError(
            f"The {model.name} is not calibrated", "It does not know where its handle is.", CALIBRATION_ADVICE
        )


def _make_missing_device_error(
    model: DeviceModel, other_devices: list[tuple[str, str | None]], failures: list[LibraryError]
) -> DeviceError:
    """Error where no device of the model could be opened, with the most probable cause. other_devices: the vendor's
    name of each other device found, and the name that `--device` takes, if any; failures: of devices that did not
    open or answer."""
    title = f"There is no {model.name}"
    if any(failure.code == DEVICE_IN_USE for failure in failures):
        return DeviceError(title, "A device is there, and another program has it.", "Close the other program.")
    if other_devices:
        return _make_other_models_error(model, other_devices)
    if any(not device.may_open for device in find_usb_devices() or ()):
        return DeviceError(title, "A device is plugged in, and this account may not open it.", PERMISSION_ADVICE)
    if failures:
        return DeviceError(
            title, f"A device is there and cannot be opened: {failures[0]}.", "Switch it off and on, then try again."
        )
    return DeviceError(title, "No device of the vendor answers.", "Plug its USB cable in and switch its power on.")


def _make_other_models_error(model: DeviceModel, other_devices: list[tuple[str, str | None]]) -> DeviceError:
    """Error where only devices of other models were found; it names them. other_devices: as for
    `_make_missing_device_error`."""
    option_texts = [f"`--device {name}`" for _, name in other_devices if name is not None]
    device_names = ", ".join(name or f"{reported!r}, which hapteq does not drive" for reported, name in other_devices)
    plug_in_text = f"plug the {model.name} in and switch its power on."
    remedy = (
        f"Use {' or '.join(option_texts)}, or {plug_in_text}"
        if option_texts
        else plug_in_text[:1].upper() + plug_in_text[1:]
    )
    return DeviceError(f"There is no {model.name}", f"Found instead: {device_names}.", remedy)
