"""Opens devices by name. The rest of the program reaches a device only through this module. Every device that it
returns for playing forces is behind the safety layer (`study.devices.safe`); only `accept_device` also commands past
it, to test the cap of the vendor's library.

Modules that take long to import (numba above all) are imported when a device is opened, so that the command line starts
at once.
"""

import contextlib
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from dataclasses import replace
from datetime import UTC, date, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from study.devices.admission import HAND_STIMULUS_CAP_N as HAND_STIMULUS_CAP_N
from study.devices.clock import Clock
from study.devices.device import CALIBRATED as CALIBRATED
from study.devices.device import REPLAY, Device, DeviceInfo, DeviceSettings
from study.devices.force_dimension.device_models import MODELS
from study.errors import DeviceError
from study.session.views.participant_views import DeviceFinding

if TYPE_CHECKING:
    from equalizer.linkage.calibration import LinkageReading
    from equalizer.signals.signal import FloatArray
    from study.devices.masking_sound import MaskingSound, Samples
    from study.devices.onset_line import OnsetLine
    from study.devices.telemetry import TelemetryReader

SIMULATED = "simulated"
"""Name of the simulated omega.3, as `--device` takes it."""

REAL = tuple(MODELS)
"""Names of the real devices, which need the vendor's library and real time."""

STRONGEST_N = max(model.max_force_n for model in MODELS.values())
"""Largest force of the strongest real device (N): a setting above it is a mistake."""

DEVICES = (SIMULATED, *REAL)
"""Names of the devices on which a study or a recording may be made."""

FRICTIONLESS = "simulated-frictionless"
"""Name of the simulated omega.3 without dry friction in its drives: the comparison shows the effect of friction. Not
among `DEVICES`."""

SIMULATIONS = (SIMULATED, FRICTIONLESS)
"""Names of the simulated devices, which need no real clock."""


def needs_real_time(name: str) -> bool:
    """Whether the device with this name runs in real time; simulated devices, also those from a recording or a
    calibration file, run in virtual time."""
    return name not in SIMULATIONS and not name.startswith((REPLAY, CALIBRATED))


class LinkageSource(Protocol):
    """Interface to the linkage (kinematics and inertia) that a device reports of itself."""

    @property
    def info(self) -> DeviceInfo:
        """Name, rate, maximum force and mass of the device."""
        ...

    def compute_reading_at(self, position_m: "FloatArray") -> "LinkageReading | None":
        """The linkage at a position (3,), m, also where the handle is elsewhere; None out of reach. Raises
        `DeviceError`."""
        ...

    def compute_angles_at(self, position_m: "FloatArray") -> "FloatArray | None":
        """Joint angles (3,), rad, at a position of the handle (3,), m; None out of reach. Raises `DeviceError`."""
        ...

    def check_frame(self) -> None:
        """Raises `DeviceError` where the positions of `compute_reading_at` and `compute_angles_at` are not in the axes
        of the device's readings, in which a calibration of the linkage needs them."""
        ...


def open_device(
    name: str, settings: DeviceSettings, clock: Clock, seed: int, *, own_process: bool = True, telemetry: str = ""
) -> Device:
    """Open a device behind the safety layer. seed: of the random numbers of a simulated device. own_process: run the
    loop of a real device in a separate process, which alone holds the device; False within that process, and in tests.
    telemetry: path of the caller's telemetry ring; empty: a new ring, if in real time and own_process. Raises
    `DeviceError`, and `StudyError` for a recording or calibration that cannot be used."""
    if name not in SIMULATIONS and name not in REAL and not name.startswith((REPLAY, CALIBRATED)):
        raise _make_unknown_device_error(name)
    if name in REAL and clock.virtual:
        raise DeviceError(
            "A real device needs real time", f"'{name}' was to be played faster than time passes.", "Use a real clock."
        )
    if name in REAL and own_process:
        from study.devices.loop_process.remote_device import open_remotely

        return open_remotely(name, settings, seed)
    from study.devices.rigs_by_name import find_rig
    from study.devices.safe import SafeDevice
    from study.devices.telemetry import Ring

    rig = find_rig(name, settings, seed)
    ring: Ring | None = None
    try:
        _check_hand(name, rig.info, settings)
        ring = Ring(telemetry) if telemetry or (own_process and not clock.virtual) else None
        return SafeDevice(rig, settings, clock, ring)
    except BaseException:
        rig.close()
        if ring is not None:
            ring.remove()
        raise


def _check_hand(name: str, info: DeviceInfo, settings: DeviceSettings) -> None:
    """Raises `DeviceError` where a hand is to hold a device without a valid acceptance. Only a device that is simulated
    by its name and by its driver needs none: the statement of a lab's own driver alone does not suffice."""
    if settings.hand_on_handle and (needs_real_time(name) or not info.simulated):
        find_accepted_baseline(info, datetime.now(UTC).date())


@contextlib.contextmanager
def open_linkage(name: str) -> "Iterator[LinkageSource]":
    """Context with the source of a device's linkage: joint angles, Jacobian and inertia by position. Nothing moves, and
    a real device stays braked. Raises `DeviceError`."""
    if name in REAL:
        from study.devices.force_dimension.linkage import open_vendor_linkage

        with open_vendor_linkage(name) as linkage:
            yield linkage
    elif name == SIMULATED:
        from study.devices.simulated.simulated_linkage import make_simulated_linkage

        yield make_simulated_linkage()
    else:
        raise (
            _make_unknown_device_error(name)
            if ":" not in name
            else DeviceError(
                "This device has no linkage that can be read",
                f"{name!r} is made from a file, which contains all that is known of it.",
                f"Calibrate {SIMULATED} or a device of {', '.join(REAL)}.",
            )
        )


def _make_unknown_device_error(name: str) -> DeviceError:
    """Error for a name that belongs to no device; it lists the known names."""
    return DeviceError(
        f"There is no device called {name!r}",
        f"Known are {', '.join(DEVICES)}, {REPLAY}FILE.h5 for a recording, and {CALIBRATED}FILE.h5 for a calibration.",
        f"Use --device {SIMULATED} where no device is at hand.",
    )


def open_telemetry(path: str) -> "TelemetryReader":
    """Reader of the telemetry ring of a running loop. path: of the ring. Raises `StudyError` where the loop has ended
    or its ring cannot be read."""
    from study.devices.telemetry import TelemetryReader

    return TelemetryReader(Path(path))


def find_onset_line() -> "OnsetLine | None":
    """Open the line for onset pulses that the lab's file names; None where it names none. Raises `DeviceError`."""
    from study.devices.force_dimension.lab import read_lab
    from study.devices.onset_line import open_onset_line

    settings = read_lab().pulse
    return None if settings is None else open_onset_line(settings)


def make_masking_sound(samples: "Samples", rate_hz: int) -> "MaskingSound":
    """Masking noise: `samples`, repeated on the system's sound output, not yet started. Raises `DeviceError` where
    there is no sound output."""
    from study.devices.masking_sound import MaskingSound, open_stream

    return MaskingSound(samples, rate_hz, open_stream)


def raise_thread_priority() -> AbstractContextManager[object]:
    """Context in which the calling thread has the real-time priority of a real device's loop, where the system allows
    it."""
    from study.devices.drive.real_time_class import real_time_class

    return real_time_class()


def check_loop_priority() -> DeviceFinding:
    """Finding on whether the system grants real-time priority to this account's loops."""
    from study.devices.drive.real_time_class import check_real_time_rights

    return check_real_time_rights()


def examine_device(name: str) -> tuple[DeviceFinding, ...]:
    """Findings on a real device and its driver, with zero force; empty for other devices. Never raises."""
    if name not in REAL:
        return ()
    from study.devices.force_dimension.findings import examine

    return examine(name)


def calibrate_device(name: str, patience_s: float) -> None:
    """Wait, at most `patience_s`, until a person has moved the handle of a real device into its calibration position.
    Raises `DeviceError`."""
    if name not in REAL:
        raise DeviceError("There is nothing to calibrate", f"{name!r} is no real device.", "Leave --calibrate out.")
    from study.devices.force_dimension.findings import calibrate

    calibrate(name, patience_s)


def calibrate_accelerometer(
    port: str, baud: int, await_position: Callable[[str, tuple[float, float, float] | None], None]
) -> str:
    """Calibrate an accelerometer by gravity in six positions (`six_positions.calibrate_on_table`). Returns the table
    for the lab's file, as TOML. Raises `DeviceError`."""
    from study.devices.accelerometer.six_positions import calibrate_on_table

    return calibrate_on_table(port, baud, await_position)


def save_accelerometer_calibration(table: str) -> Path:
    """Write the table of an accelerometer's calibration into the lab's file. Raises `DeviceError`, and then leaves the
    file unchanged."""
    from study.devices.force_dimension.lab import write_sensor_table

    return write_sensor_table(table)


def get_lab_file_path() -> Path:
    """Path of the lab's settings of its device; the file need not exist."""
    from study.devices.force_dimension.lab import locate_lab_file

    return locate_lab_file()


def get_device_folder() -> Path:
    """Folder of this computer's data about its device: settings, acceptance, baseline and daily checks."""
    return get_lab_file_path().parent


def find_accepted_baseline(info: DeviceInfo, today: date) -> tuple[str, str]:
    """File name (in `get_device_folder()`) and SHA-256 of the baseline recording of the acceptance; both empty where
    none was made. Raises `DeviceError` where this device was not accepted, or too long ago."""
    from study.devices.force_dimension.acceptance import check_accepted

    return check_accepted(info, today)


def get_limit_test_force_n() -> float:
    """Cap (N) under which `accept_device` tests the device, and the force that it holds on the handle."""
    from study.devices.force_dimension.force_limit_check import TEST_FORCE_N

    return TEST_FORCE_N


def accept_device(
    name: str, settings: DeviceSettings, clock: Clock, operator: str, baseline: tuple[str, str] = ("", "")
) -> str:
    """Acceptance test of the force limit, with no hand on the handle: command more than the cap, hold a small force,
    stop the loop on purpose; write the acceptance if the device got no more than the cap and dropped the force. Returns
    a sentence with the results. Raises `DeviceError`. The caller (`study.workflows.checks.examine_setup`) has made all
    other checks before. operator: name of the person; baseline: file name and SHA-256 of the recording for the daily
    check."""
    from study.devices.force_dimension.acceptance import Acceptance, write_acceptance
    from study.devices.force_dimension.force_limit_check import (
        COMMAND_TO_CAP_RATIO,
        TEST_FORCE_N,
        check_cap_holds,
        check_force_vanishes,
        require_testable,
    )
    from study.devices.rigs_by_name import RIGS_BY_NAME
    from study.devices.safe import SafeDevice

    limits = replace(settings.limits, stimulus_cap_n=TEST_FORCE_N, total_cap_n=TEST_FORCE_N)
    settings = replace(settings, hand_on_handle=False, limits=limits)
    rig: Any = RIGS_BY_NAME[name](settings, 0)
    try:
        require_testable(rig)
        device = SafeDevice(rig, settings, clock)
        with contextlib.closing(device):
            largest_force_n = check_cap_holds(device, rig)
            force_off_after_s = check_force_vanishes(device, rig)
    finally:
        rig.close()
    today, info = clock.utc()[:10], device.info
    test_results = TEST_FORCE_N, force_off_after_s, COMMAND_TO_CAP_RATIO * TEST_FORCE_N, largest_force_n
    path = write_acceptance(Acceptance(info.name, info.details, operator, today, *test_results, *baseline))
    return (
        f"{info.name}: of {COMMAND_TO_CAP_RATIO * TEST_FORCE_N:g} N that were commanded with a cap of "
        f"{TEST_FORCE_N:g} N it gave {largest_force_n:.2g} N; a force of {TEST_FORCE_N:g} N was gone "
        f"{1000 * force_off_after_s:.0f} ms after the loop; {path}"
    )
