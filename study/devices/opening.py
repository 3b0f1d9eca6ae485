"""Opens devices by name, for the packages outside `study.devices` and the process of the control loop
(`loop_process.serve`). Begin at `open_device`.

Every device that it returns for playing forces is behind the safety layer (`study.devices.safe`); only `accept_device`
also sends commands without it, to test the force cap of the vendor's library. Modules with a slow import (numba above
all) are imported when a device is opened, so that the command line starts quickly.
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
from study.devices.device import CALIBRATED_PREFIX as CALIBRATED_PREFIX
from study.devices.device import REPLAY_PREFIX, Device, DeviceInfo, DeviceSettings
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
"""Name of the simulated omega.3, as in `--device`."""

REAL_DEVICES = tuple(MODELS)
"""Names of the real devices, which need the vendor's library and a real-time clock."""

LARGEST_DEVICE_FORCE_N = max(model.max_force_n for model in MODELS.values())
"""Largest force (N) of all real devices."""

DEVICES = (SIMULATED, *REAL_DEVICES)
"""Names of the devices that are offered for studies and recordings."""

FRICTIONLESS = "simulated-frictionless"
"""Name of the simulated omega.3 without dry friction in its drives, for comparison with `SIMULATED`; not in
`DEVICES`."""

SIMULATIONS = (SIMULATED, FRICTIONLESS)
"""Names of the simulated devices, which can run in virtual time."""


def needs_real_time(name: str) -> bool:
    """Whether the device with this name needs real time; simulated devices, also those from a recording or a
    calibration file, can run in virtual time."""
    return name not in SIMULATIONS and not name.startswith((REPLAY_PREFIX, CALIBRATED_PREFIX))


class LinkageSource(Protocol):
    """Interface to the linkage data (kinematics and inertia) that a device's driver returns."""

    @property
    def info(self) -> DeviceInfo:
        """Name, rate, maximum force and mass of the device."""
        ...

    def compute_reading_at(self, position_m: "FloatArray") -> "LinkageReading | None":
        """Linkage data at any position (3,), m, of the workspace; None out of reach. Raises `DeviceError`."""
        ...

    def compute_angles_at(self, position_m: "FloatArray") -> "FloatArray | None":
        """Joint angles (3,), rad, at a position of the handle (3,), m; None out of reach. Raises `DeviceError`."""
        ...

    def check_frame(self) -> None:
        """Raise `DeviceError` where the positions of `compute_reading_at` and `compute_angles_at` are in other axes
        than the device's readings; a calibration of the linkage requires the same axes."""
        ...


def open_device(
    name: str, settings: DeviceSettings, clock: Clock, seed: int, *, own_process: bool = True, telemetry: str = ""
) -> Device:
    """Open a device behind the safety layer. seed: of the random numbers of a simulated device. own_process: run the
    control loop of a real device in a separate process; False within that process. telemetry: path of the caller's
    telemetry ring; empty: a new ring if the clock is not virtual and own_process is True, else none. Raises
    `DeviceError`, and `StudyError` for a recording or calibration that cannot be used."""
    if name not in SIMULATIONS and name not in REAL_DEVICES and not name.startswith((REPLAY_PREFIX, CALIBRATED_PREFIX)):
        raise _make_unknown_device_error(name)
    if name in REAL_DEVICES and clock.virtual:
        raise DeviceError(
            "A real device needs real time", f"'{name}' was to be played faster than time passes.", "Use a real clock."
        )
    if name in REAL_DEVICES and own_process:
        from study.devices.loop_process.remote_device import open_remotely

        return open_remotely(name, settings, seed)
    from study.devices.rigs_by_name import build_rig
    from study.devices.safe import SafeDevice
    from study.devices.telemetry import Ring

    rig = build_rig(name, settings, seed)
    ring: Ring | None = None
    try:
        _check_acceptance(name, rig.info, settings)
        ring = Ring(telemetry) if telemetry or (own_process and not clock.virtual) else None
        return SafeDevice(rig, settings, clock, ring)
    except BaseException:
        rig.close()
        if ring is not None:
            ring.remove()
        raise


def _check_acceptance(name: str, info: DeviceInfo, settings: DeviceSettings) -> None:
    """Raise `DeviceError` where a hand is to hold a device without a valid acceptance test. A device needs none only if
    it is simulated both by its name and by the statement of its driver (`DeviceInfo.simulated`)."""
    if settings.hand_on_handle and (needs_real_time(name) or not info.simulated):
        find_accepted_baseline(info, datetime.now(UTC).date())


@contextlib.contextmanager
def open_linkage(name: str) -> "Iterator[LinkageSource]":
    """Open the source of a device's linkage data: joint angles, Jacobian and inertia by position. Nothing moves, and a
    real device stays braked. Raises `DeviceError`."""
    if name in MODELS:
        from study.devices.force_dimension.linkage import open_vendor_linkage

        with open_vendor_linkage(name) as linkage:
            yield linkage
    elif name == SIMULATED:
        from study.devices.simulated.simulated_linkage import make_simulated_linkage

        yield make_simulated_linkage()
    elif name in REAL_DEVICES or ":" in name:
        happened = "made from a file, which contains all that is known of it" if ":" in name else "of another vendor"
        remedy = f"Calibrate {SIMULATED} or a device of {', '.join(MODELS)}."
        raise DeviceError("This device has no linkage that can be read", f"{name!r} is {happened}.", remedy)
    else:
        raise _make_unknown_device_error(name)


def _make_unknown_device_error(name: str) -> DeviceError:
    """Make the error for a name that belongs to no device; it lists `DEVICES` and the kinds of files."""
    return DeviceError(
        f"There is no device called {name!r}",
        f"Known are {', '.join(DEVICES)}, {REPLAY_PREFIX}FILE.h5 for a recording, and {CALIBRATED_PREFIX}FILE.h5 for a "
        "calibration.",
        f"Use --device {SIMULATED} where no device is at hand.",
    )


def open_telemetry(path: str) -> "TelemetryReader":
    """Open a reader of the telemetry ring of a running control loop. path: of the ring. Raises `StudyError` where the
    loop has ended or its ring cannot be read."""
    from study.devices.telemetry import TelemetryReader

    return TelemetryReader(Path(path))


def open_lab_onset_line() -> "OnsetLine | None":
    """Open the line for onset pulses that is set in the lab's file; None where none is set. Raises `DeviceError`."""
    from study.devices.force_dimension.lab import read_lab_settings
    from study.devices.onset_line import open_onset_line

    settings = read_lab_settings().pulse
    return None if settings is None else open_onset_line(settings)


def make_masking_sound(samples: "Samples", rate_hz: int) -> "MaskingSound":
    """Make the masking noise: `samples`, repeated on the system's sound output, not yet started. rate_hz: sample rate.
    Raises `DeviceError` where there is no sound output."""
    from study.devices.masking_sound import MaskingSound, open_stream

    return MaskingSound(samples, rate_hz, open_stream)


def raise_thread_priority() -> AbstractContextManager[object]:
    """Context in which the calling thread has the real-time priority of a real device's control loop, where the system
    permits it."""
    from study.devices.drive.real_time_class import request_real_time_class

    return request_real_time_class()


def check_loop_priority() -> DeviceFinding:
    """Check whether the system permits real-time priority to this user account."""
    from study.devices.drive.real_time_class import check_real_time_rights

    return check_real_time_rights()


def examine_device(name: str) -> tuple[DeviceFinding, ...]:
    """Examine a device of Force Dimension and its driver, with zero force; empty for other devices. Problems are
    returned as findings, not raised."""
    if name not in MODELS:
        return ()
    from study.devices.force_dimension.findings import examine

    return examine(name)


def calibrate_device(name: str, timeout_s: float) -> None:
    """Wait, at most `timeout_s` (s), until a person has moved the handle of a device of Force Dimension into its
    calibration position. Raises `DeviceError`, also for any other device."""
    if name not in MODELS:
        raise DeviceError(
            "There is nothing to calibrate", f"{name!r} is no device of Force Dimension.", "Leave --calibrate out."
        )
    from study.devices.force_dimension.findings import calibrate

    calibrate(name, timeout_s)


def calibrate_accelerometer(
    port: str, baud: int, await_position: Callable[[str, tuple[float, float, float] | None], None]
) -> str:
    """Calibrate an accelerometer by gravity in six positions (`six_positions.calibrate_in_six_positions`). baud: of the
    serial port (bit/s). Returns the calibration as a TOML table for the lab's file. Raises `DeviceError`."""
    from study.devices.accelerometer.six_positions import calibrate_in_six_positions

    return calibrate_in_six_positions(port, baud, await_position)


def save_accelerometer_calibration(table: str) -> Path:
    """Write the TOML table of an accelerometer's calibration into the lab's file. Returns its path. Raises
    `DeviceError`; the previous content then remains, in that file or in `NAME.before`."""
    from study.devices.force_dimension.lab import write_sensor_table

    return write_sensor_table(table)


def get_lab_file_path() -> Path:
    """Path of the lab's file, with the settings of its device; it need not exist."""
    from study.devices.force_dimension.lab import locate_lab_file

    return locate_lab_file()


def get_device_folder() -> Path:
    """Folder of this computer's data about its device: settings, acceptance, baseline and daily checks."""
    return get_lab_file_path().parent


def find_accepted_baseline(info: DeviceInfo, today: date) -> tuple[str, str]:
    """Find file name (in `get_device_folder()`) and SHA-256 of the baseline recording of the acceptance test; both
    empty where none was made. Raises `DeviceError` where this device was not accepted, or too long ago."""
    from study.devices.force_dimension.acceptance import check_accepted

    return check_accepted(info, today)


def get_limit_test_force_n() -> float:
    """Force cap (N) with which `accept_device` tests the device; also the force that it holds."""
    from study.devices.force_dimension.force_limit_check import TEST_FORCE_N

    return TEST_FORCE_N


def require_testable_device(name: str, settings: DeviceSettings) -> None:
    """Raise `DeviceError` where the driver of a real device lacks the methods that `accept_device` needs. No force."""
    from study.devices.force_dimension.force_limit_check import require_testable
    from study.devices.rigs_by_name import RIGS_BY_NAME

    with contextlib.closing(RIGS_BY_NAME[name](settings, 0)) as rig:
        require_testable(rig)


def accept_device(
    name: str, settings: DeviceSettings, clock: Clock, operator: str, baseline: tuple[str, str] = ("", "")
) -> str:
    """Test the force limit of a real device without a hand on the handle: command more than the cap, hold the force of
    the cap, stop the loop; write the acceptance if the force stayed within the cap and was switched off. Returns a
    sentence with the results. Raises `DeviceError`. operator: name of the person; baseline: file name and SHA-256 of
    the recording for the daily check."""
    from study.devices.force_dimension import force_limit_check
    from study.devices.force_dimension.acceptance import Acceptance, write_acceptance
    from study.devices.rigs_by_name import RIGS_BY_NAME
    from study.devices.safe import SafeDevice

    test_force_n = get_limit_test_force_n()
    commanded_n = force_limit_check.COMMAND_TO_CAP_RATIO * test_force_n
    limits = replace(settings.limits, stimulus_cap_n=test_force_n, total_cap_n=test_force_n)
    settings = replace(settings, hand_on_handle=False, limits=limits)
    rig: Any = RIGS_BY_NAME[name](settings, 0)
    try:
        force_limit_check.require_testable(rig)
        device = SafeDevice(rig, settings, clock)
        with contextlib.closing(device):
            largest_force_n = force_limit_check.check_cap_holds(device, rig)
            force_off_after_s = force_limit_check.check_force_vanishes(device, rig)
    finally:
        rig.close()
    today, info = clock.utc()[:10], device.info
    test_results = test_force_n, force_off_after_s, commanded_n, largest_force_n
    path = write_acceptance(Acceptance(info.name, info.details, operator, today, *test_results, *baseline))
    return (
        f"{info.name}: of {commanded_n:g} N that were commanded with a cap of {test_force_n:g} N it gave "
        f"{largest_force_n:.2g} N; a force of {test_force_n:g} N was gone {1000 * force_off_after_s:.0f} ms after the "
        f"loop; {path}"
    )
