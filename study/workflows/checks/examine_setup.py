"""All checks of a set-up before a study: installation, device, and timing of the 1 kHz force loop. Called by
`hapteq doctor`.

The timing of the device's loop is compared with that of a bare loop in a process of its own, which separates delays of
the computer from those of this program. After a successful examination a device may be accepted for use with a hand.
"""

import contextlib
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from study.devices.clock import Clock, RealClock
from study.devices.device import Device, DeviceSettings
from study.devices.opening import accept_device, examine_device, get_limit_test_force_n, needs_real_time, open_device
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

PROTOCOL_NAME = "direction_threshold"
"""Protocol whose safety limits and settings the device is opened with."""

OPTIONAL_FINDINGS = ("Accelerometer",)
"""Names of findings that do not affect the force: they do not prevent the use of the device."""

HOLD_MARGIN_S = 5.0
"""Margin (s) by which the longest permitted hold exceeds the duration of the timing measurement."""


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
        timing = self.timing.findings if self.timing is not None else ()
        return (*self.installation, *self.device.findings, *timing)

    @property
    def sensed(self) -> bool:
        """Whether no finding about the accelerometer is bad."""
        return all(finding.fine for finding in self.findings if finding.name in OPTIONAL_FINDINGS)

    @property
    def exit_code(self) -> ExitCode:
        """Exit code: DEVICE if a finding about device or timing is wrong, else ERROR if one about the installation is,
        else DONE. Warnings are ignored."""
        timing = self.timing.findings if self.timing is not None else ()
        if any(finding.wrong for finding in (*self.device.findings, *timing)):
            return ExitCode.DEVICE
        return ExitCode.ERROR if any(finding.wrong for finding in self.installation) else ExitCode.DONE


def examine_setup(
    device: str, data: Path, timing_s: float, terminal: Terminal | None, on_progress: Callable[[float], None]
) -> Examination:
    """Run all checks in real time. device: its name; data: data folder; terminal: None outside a terminal. timing_s:
    duration of the timing (s), 0 for none; on_progress: as for `check_timing`. A device that cannot be opened, or is
    lost, results in a finding, not an error."""
    installation = check_installation(data, terminal)
    report, timing = _examine_device(device, timing_s, on_progress)
    return Examination(installation, report, timing)


def _examine_device(
    name: str, timing_s: float, on_progress: Callable[[float], None]
) -> tuple[DeviceReport, Timing | None]:
    """Findings about the device and its timing; a device with a wrong finding of its driver is not opened."""
    clock, settings = RealClock(), _make_settings(name, timing_s)
    driver_findings = examine_device(name)
    report = DeviceReport(name, simulated=False, findings=driver_findings)
    if any(finding.wrong and finding.name not in OPTIONAL_FINDINGS for finding in driver_findings):
        return report, None
    has_sensor = all(finding.fine for finding in driver_findings if finding.name in OPTIONAL_FINDINGS)
    settings = replace(settings, with_sensor=has_sensor)
    try:
        with contextlib.closing(open_device(name, settings, clock, seed=1)) as device:
            total_cap_n, safety = settings.limits.total_cap_n, read_study_protocol(PROTOCOL_NAME).protocol.safety
            report = check_device(device, clock, settings.place_m, total_cap_n, safety, has_sensor)
            report = replace(report, findings=(*driver_findings, *report.findings))
            timing = _measure_timing(device, clock, timing_s, on_progress) if timing_s > 0 else None
            return report, timing
    except DeviceError as error:
        device_finding = DeviceFinding("Device", f"{error.title}. {error.happened}", fine=False, advice=error.do_now)
        return replace(report, findings=(*report.findings, device_finding)), None


def _measure_timing(device: Device, clock: Clock, duration_s: float, on_progress: Callable[[float], None]) -> Timing:
    """Measure the timing for `duration_s` (s), and compare it with a bare loop that runs at the same time."""
    load, is_simulated = get_load_per_processor(), device.info.simulated
    with run_bare_loop_in_parallel(
        duration_s, device.info.sample_rate_hz, raised_priority=not is_simulated
    ) as bare_loop_run:
        timing = check_timing(device, clock, duration_s, on_progress, load)
    # The loop of a simulated device is never late: for such a device, the wake-ups of this program are compared.
    late_ticks, ticks = timing.health.late_ticks + timing.health.missed_ticks, timing.health.ticks
    if is_simulated:
        ticks = round(duration_s * device.info.sample_rate_hz)
        late_ticks = round(timing.lateness.missed_fraction * ticks)
    comparison = compare_with_bare_loop(late_ticks, ticks, bare_loop_run)
    return replace(timing, findings=(*timing.findings, comparison, judge_load(load)))


def _make_settings(name: str, timing_s: float) -> DeviceSettings:
    """Settings of a study without the centring spring, because nothing may move during the timing; without a hand on a
    real device. timing_s: duration (s) that a hold must permit."""
    settings = make_device_settings(read_study_protocol(PROTOCOL_NAME).protocol)
    longest_hold_s = max(settings.limits.longest_hold_s, timing_s + HOLD_MARGIN_S)
    limits = replace(settings.limits, longest_hold_s=longest_hold_s)
    free_settings = replace(settings, limits=limits, spring_frequency_hz=0.0, spring_damping_n_s_per_m=0.0)
    return replace(free_settings, hand_on_handle=False) if needs_real_time(name) else free_settings


def require_sensor(examination: Examination) -> None:
    """Require a working accelerometer, without which a daily check would record no acceleration. Raises DeviceError
    otherwise."""
    if not examination.sensed:
        raise DeviceError(
            "The daily check did not begin",
            "It compares accelerations, and the accelerometer is not fine (its line above).",
            "Do what that line says, then check again.",
            saved="Nothing moved.",
        )


def accept(name: str, examination: Examination, operator: str, motion_callbacks: MotionCallbacks) -> str:
    """Record the baseline of the daily checks and the acceptance of the device for use with a hand, signed by
    `operator`; returns a sentence about it. Without an accelerometer no baseline is recorded. Raises DeviceError
    without a timing or with a wrong finding, WrongUseError for a simulated device."""
    if not needs_real_time(name):
        raise WrongUseError("There is nothing to accept", f"{name!r} moves no hand.", "Leave --accept out.")
    timing = examination.timing
    blocking_findings = [
        finding for finding in examination.findings if finding.wrong and finding.name not in OPTIONAL_FINDINGS
    ]
    if timing is None or blocking_findings:
        problem_names = ", ".join(finding.name for finding in blocking_findings) or "the timing was not measured"
        raise DeviceError(
            "The device was not accepted", f"Not fine: {problem_names}.", "Mend that first, as said above."
        )
    has_sensor = examination.sensed
    baseline = record_baseline(name, motion_callbacks) if has_sensor else ("", "")
    motion_callbacks.announce(format_limit_test_notice(name, get_limit_test_force_n()))
    settings = replace(_make_settings(name, 0.0), with_sensor=has_sensor)
    sentence = accept_device(name, settings, RealClock(), operator, baseline)
    return sentence if has_sensor else f"{sentence}. Without an accelerometer no daily check will be possible."
