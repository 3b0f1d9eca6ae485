"""Run all checks of a set-up before a study (`hapteq doctor`): installation, device, timing of the 1 kHz force loop.

The timing of the device's loop is compared with that of a bare loop in a process of its own, which separates delays of
the computer from those of this program. After a successful examination a device may be accepted for use with a hand.
"""

import contextlib
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from study.devices.clock import Clock, RealClock
from study.devices.device import Device, DeviceSettings
from study.devices.opening import (
    accept_device,
    examine_device,
    get_limit_test_force_n,
    needs_real_time,
    open_device,
    require_testable_device,
)
from study.errors import DeviceError, ExitCode, WrongUseError
from study.session.stimulus.timing_verdict import judge_load
from study.session.views.handle_notice import format_limit_test_notice
from study.session.views.participant_views import DeviceFinding, DeviceReport
from study.store.formats.protocol_files import read_study_protocol
from study.workflows.checks.bare_loop import compare_with_bare_loop, run_bare_loop_in_parallel
from study.workflows.checks.check_device import check_device
from study.workflows.checks.check_installation import Terminal, check_installation
from study.workflows.checks.check_timing import Timing, check_timing
from study.workflows.checks.computer_load import get_load_per_processor
from study.workflows.checks.daily_check import MotionCallbacks, record_baseline
from study.workflows.device_settings import make_device_settings

LIMITS_PROTOCOL_NAME = "direction_threshold"
"""Shipped study protocol whose safety limits and settings the device is opened with."""

OPTIONAL_FINDINGS = ("Accelerometer",)
"""Names of findings that do not affect the force: they do not prevent the use of the device."""

HOLD_MARGIN_S = 5.0
"""Margin (s) by which the longest permitted hold exceeds the duration of the timing measurement; chosen."""


@dataclass(frozen=True, slots=True)
class Examination:
    """Findings about installation, device and timing of a computer."""

    installation: tuple[DeviceFinding, ...]
    """Findings about the installation and the computer."""
    device: DeviceReport
    """Findings of the device's driver and of the device check."""
    timing: Timing | None
    """None if no timing was requested, or if the device could not be used."""

    @property
    def findings(self) -> tuple[DeviceFinding, ...]:
        """All findings, in the order installation, device, timing."""
        timing_findings = self.timing.findings if self.timing is not None else ()
        return (*self.installation, *self.device.findings, *timing_findings)

    @property
    def is_sensor_fine(self) -> bool:
        """Whether every finding about the accelerometer is fine; True also where there is no such finding."""
        return all(finding.fine for finding in self.findings if finding.name in OPTIONAL_FINDINGS)

    @property
    def exit_code(self) -> ExitCode:
        """Exit code: DEVICE if a finding about device or timing is wrong, else ERROR if one about the installation is,
        else DONE. Warnings are ignored."""
        timing_findings = self.timing.findings if self.timing is not None else ()
        if any(finding.wrong for finding in (*self.device.findings, *timing_findings)):
            return ExitCode.DEVICE
        return ExitCode.ERROR if any(finding.wrong for finding in self.installation) else ExitCode.DONE


def examine_setup(
    device_name: str, data: Path, timing_s: float, terminal: Terminal | None, on_progress: Callable[[float], None]
) -> Examination:
    """Run all checks in real time. device_name: as `open_device` takes it; data: data folder; terminal: None outside a
    terminal. timing_s: duration of the timing (s), 0 for none; on_progress: as for `check_timing`. A DeviceError is a
    finding; the StudyError for an unusable recording or calibration of a simulated device escapes."""
    installation = check_installation(data, terminal)
    device_report, timing = _examine_device(device_name, timing_s, on_progress)
    return Examination(installation, device_report, timing)


def _examine_device(
    device_name: str, timing_s: float, on_progress: Callable[[float], None]
) -> tuple[DeviceReport, Timing | None]:
    """Examine the device and its timing. Returns the findings, and the timing; None where none is requested (`timing_s`
    0), the driver reports a wrong finding other than of `OPTIONAL_FINDINGS` (the device is then not opened), or the
    device fails."""
    clock, settings = RealClock(), _make_settings(device_name, timing_s)
    driver_findings = examine_device(device_name)
    device_report = DeviceReport(device_name, simulated=False, findings=driver_findings)
    if any(finding.wrong and finding.name not in OPTIONAL_FINDINGS for finding in driver_findings):
        return device_report, None
    has_sensor = all(finding.fine for finding in driver_findings if finding.name in OPTIONAL_FINDINGS)
    settings = replace(settings, with_sensor=has_sensor)
    try:
        # The seed only affects the noise of a simulated device.
        with contextlib.closing(open_device(device_name, settings, clock, seed=1)) as device:
            total_cap_n, safety = settings.limits.total_cap_n, read_study_protocol(LIMITS_PROTOCOL_NAME).protocol.safety
            device_report = check_device(device, clock, settings.place_m, total_cap_n, safety, has_sensor)
            device_report = replace(device_report, findings=(*driver_findings, *device_report.findings))
            timing = _measure_timing(device, clock, timing_s, on_progress) if timing_s > 0 else None
            return device_report, timing
    except DeviceError as error:
        device_finding = DeviceFinding("Device", f"{error.title}. {error.happened}", fine=False, advice=error.do_now)
        return replace(device_report, findings=(*device_report.findings, device_finding)), None


def _measure_timing(device: Device, clock: Clock, duration_s: float, on_progress: Callable[[float], None]) -> Timing:
    """Measure the timing for `duration_s` (s), and compare it with a bare loop that runs at the same time."""
    load_per_processor, is_simulated = get_load_per_processor(), device.info.simulated
    with run_bare_loop_in_parallel(
        duration_s, device.info.sample_rate_hz, raised_priority=not is_simulated
    ) as bare_loop_run:
        timing = check_timing(device, clock, duration_s, on_progress, load_per_processor)
    # The loop of a simulated device is never late: for such a device, the wake-ups of this program are compared.
    late_ticks, ticks = timing.health.late_ticks + timing.health.missed_ticks, timing.health.ticks
    if is_simulated:
        ticks = round(duration_s * device.info.sample_rate_hz)
        late_ticks = round(timing.lateness.missed_fraction * ticks)
    comparison_finding = compare_with_bare_loop(late_ticks, ticks, bare_loop_run)
    return replace(timing, findings=(*timing.findings, comparison_finding, judge_load(load_per_processor)))


def _make_settings(device_name: str, timing_s: float) -> DeviceSettings:
    """Make the settings of a study without the centring spring, because nothing may move during the timing; without a
    hand on a real device. timing_s: duration (s) that a hold must permit."""
    settings = make_device_settings(read_study_protocol(LIMITS_PROTOCOL_NAME).protocol)
    longest_hold_s = max(settings.limits.longest_hold_s, timing_s + HOLD_MARGIN_S)
    limits = replace(settings.limits, longest_hold_s=longest_hold_s)
    free_settings = replace(settings, limits=limits, spring_frequency_hz=0.0, spring_damping_n_s_per_m=0.0)
    return replace(free_settings, hand_on_handle=False) if needs_real_time(device_name) else free_settings


def require_sensor(examination: Examination) -> None:
    """Raise DeviceError where a finding about the accelerometer is not fine: a daily check records accelerations."""
    if not examination.is_sensor_fine:
        raise DeviceError(
            "The daily check did not begin",
            "It compares accelerations, and the accelerometer is not fine (its line above).",
            "Do what that line says, then check again.",
            saved="Nothing moved.",
        )


def accept_examined_device(
    device_name: str, examination: Examination, operator: str, motion_callbacks: MotionCallbacks
) -> str:
    """Record the baseline of the daily checks and the acceptance of the device for use with a hand, signed by
    `operator`; returns a sentence about it. Without a working accelerometer no baseline is recorded. Raises StudyError
    for a simulated device, without a timing, with a wrong finding other than of `OPTIONAL_FINDINGS`, for a driver that
    cannot be tested, and where baseline or acceptance fail."""
    if not needs_real_time(device_name):
        raise WrongUseError("There is nothing to accept", f"{device_name!r} moves no hand.", "Leave --accept out.")
    timing = examination.timing
    blocking_findings = [
        finding for finding in examination.findings if finding.wrong and finding.name not in OPTIONAL_FINDINGS
    ]
    if timing is None or blocking_findings:
        problem_names = ", ".join(finding.name for finding in blocking_findings) or "the timing was not measured"
        raise DeviceError(
            "The device was not accepted", f"Not fine: {problem_names}.", "Mend that first, as said above."
        )
    has_sensor = examination.is_sensor_fine
    settings = replace(_make_settings(device_name, 0.0), with_sensor=has_sensor)
    require_testable_device(device_name, settings)  # before anything moves
    baseline = record_baseline(device_name, motion_callbacks) if has_sensor else ("", "")
    motion_callbacks.announce(format_limit_test_notice(device_name, get_limit_test_force_n()))
    sentence = accept_device(device_name, settings, RealClock(), operator, baseline)
    return sentence if has_sensor else f"{sentence}. Without an accelerometer no daily check will be possible."
