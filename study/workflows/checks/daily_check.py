"""Daily check of a device: play the excitation of its acceptance without a hand, and compare both recordings.

`record_baseline` records at the acceptance, `check_today` carries out the check, and `judge_last_check` reads the last
result before a sitting.
"""

import contextlib
import math
from collections.abc import Callable
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from equalizer.signals.recording import Recording
from protocols.definition.recording_protocol import RecordingProtocol
from protocols.document.hashing import hash_protocol
from study.devices.clock import RealClock
from study.devices.device import Device, DeviceInfo
from study.devices.opening import find_accepted_baseline, get_device_folder, needs_real_time, open_device
from study.errors import DeviceError, StudyError, WrongUseError
from study.local_clock import convert_to_machine_zone
from study.session.views.local_time import format_time_in_zone, split_time_in_zone
from study.session.views.participant_views import DeviceFinding
from study.store.disk.provenance import compute_sha256
from study.store.formats.daily_check_file import DailyCheck, read_daily_check, write_daily_check
from study.store.formats.protocol_files import read_recording_protocol
from study.store.formats.recording_file import read_recording
from study.workflows.checks.device_changes import make_change_findings
from study.workflows.recording.record_device import RecordingPlan, make_recording_settings, record_on_device

if TYPE_CHECKING:
    from analysis.device_change.compare_measurements import Change

CHECK_PROTOCOL_NAME = "daily_check"
"""Shipped recording protocol of the check, and of the acceptance."""
BASELINE_FOLDER, CHECK_FOLDER = "baselines", "daily_checks"
"""Folders of the recordings of acceptances and of daily checks, in `get_device_folder()`."""


@dataclass(frozen=True, slots=True)
class MotionCallbacks:
    """Callbacks for the caller of a check or baseline, during which the device moves by itself."""

    announce: Callable[[str], None]
    """Receives the notice before it moves; an exception from it keeps the device still."""
    show: Callable[[float], None]
    """Receives the seconds played so far."""


@dataclass(frozen=True, slots=True)
class DailyCheckResult:
    """Findings of today's check, and the file to which they were written."""

    findings: tuple[DeviceFinding, ...]
    file: Path


def compute_play_duration_s() -> float:
    """Compute the total duration (s) of the excitation of a baseline or daily check."""
    return RecordingPlan(_read_protocol(), "", (0.0, 0.0, 0.0), 1, Path()).total_s


def record_baseline(device_name: str, motion_callbacks: MotionCallbacks) -> tuple[str, str]:
    """Record the baseline of the daily checks. Returns its path relative to `get_device_folder()`, and its SHA-256.
    Raises StudyError, also where the recording is not good enough for a comparison."""
    plan = _plan_recording(device_name, BASELINE_FOLDER)
    with contextlib.closing(_open_free_device(plan)) as device:
        return _record_baseline_on(device, plan, motion_callbacks)


def _record_baseline_on(device: Device, plan: RecordingPlan, motion_callbacks: MotionCallbacks) -> tuple[str, str]:
    """Record the baseline on an open device, and refuse it where sensor or force was at its limit, or where it is too
    inaccurate. Returns and raises as `record_baseline`."""
    record_on_device(device, plan, motion_callbacks.show, motion_callbacks.announce)
    recording = read_recording(plan.out)
    segments = recording.meta["segments"]
    limited_segments = [
        segment
        for segment in segments
        if segment["played_amplitude_n"] < segment["requested_amplitude_n"]
        or segment["sensor_clipped"]
        or segment["total_clipped"]
    ]
    problems = (
        [f"Sensor or force was at its limit in {len(limited_segments)} of {len(segments)} pieces."]
        if limited_segments
        else []
    )
    # A recording compared with itself does not differ: a finding means that it is too inaccurate to detect a later
    # change.
    inaccurate_findings = [
        finding for finding in make_change_findings(compare_recordings(recording, recording)) if not finding.fine
    ]
    problems += [f"Too inaccurate to compare with: {finding.name}, {finding.value}." for finding in inaccurate_findings]
    if problems:
        advice = "Look for what holds the handle, disturbs the sensor or shakes the table; then accept it again."
        raise DeviceError("The device was not accepted", " ".join(problems), advice, f"The recording is {plan.out}.")
    return f"{BASELINE_FOLDER}/{plan.out.name}", compute_sha256(plan.out)


def require_acceptable_device(device_name: str) -> None:
    """Raise WrongUseError for a device that is never accepted, such as a simulated one."""
    if not needs_real_time(device_name):
        raise WrongUseError(
            "There is nothing to compare with", f"{device_name!r} is never accepted.", "Leave --daily out."
        )


def check_today(device_name: str, motion_callbacks: MotionCallbacks) -> DailyCheckResult:
    """Play the excitation of the baseline on this device, and write what changed. Raises StudyError."""
    plan = _plan_recording(device_name, CHECK_FOLDER)
    with contextlib.closing(_open_free_device(plan)) as device:
        return check_on_device(device, plan, motion_callbacks)


def check_on_device(device: Device, plan: RecordingPlan, motion_callbacks: MotionCallbacks) -> DailyCheckResult:
    """Carry out the check of `check_today` on an open device. An exception after the notice of the motion is written as
    a check that was not passed, and raised again."""
    baseline, baseline_sha256 = _read_baseline(device.info, plan.protocol)
    notices: list[str] = []

    def announce(notice: str) -> None:
        motion_callbacks.announce(notice)
        notices.append(notice)

    try:
        record_on_device(device, plan, motion_callbacks.show, announce)
        changes = compare_recordings(baseline, read_recording(plan.out))
    except BaseException as error:
        if notices:  # A check that was passed earlier on the same day must not remain valid.
            with contextlib.suppress(StudyError, OSError):
                reason = str(error) or type(error).__name__
                _write_check(device.info, plan, baseline_sha256, False, (f"It broke off: {reason}",), ())
        raise
    findings = make_change_findings(changes)
    passed = all(finding.fine for finding in findings)
    sentences = tuple(f"{finding.name}: {finding.value}. {finding.advice}".strip() for finding in findings)
    return DailyCheckResult(findings, _write_check(device.info, plan, baseline_sha256, passed, sentences, changes))


def _write_check(
    info: DeviceInfo,
    plan: RecordingPlan,
    baseline_sha256: str,
    passed: bool,
    sentences: tuple[str, ...],
    changes: tuple["Change", ...],
) -> Path:
    """Write the result of a check beside its recording. Returns the path of the JSON file."""
    check = DailyCheck(
        device=info.name,
        details=info.details,
        utc=datetime.now(UTC).isoformat(timespec="seconds"),
        passed=passed,
        sentences=sentences,
        changes=tuple(_convert_change_to_json(change) for change in changes),
        recording=plan.out.name if plan.out.exists() else "",
        recording_sha256=compute_sha256(plan.out) if plan.out.exists() else "",
        baseline_sha256=baseline_sha256,
    )
    file = plan.out.with_suffix(".json")
    write_daily_check(file, check)
    return file


def compare_recordings(baseline: Recording, todays_recording: Recording) -> tuple["Change", ...]:
    """Compute the changes of friction, gain, response and noise from the recording of the acceptance to today's. Raises
    DeviceError where they cannot be measured in one of the recordings."""
    # Imported here: every sitting reads the last check, but only a check needs the comparison, which is slow to import.
    from analysis.device_change.compare_measurements import compare_measurements
    from analysis.device_change.measure_device import NotMeasurableError

    try:
        return compare_measurements(baseline, todays_recording)
    except NotMeasurableError as error:
        explanation = f"The recording does not show how the device responds: {error}."
        advice = "Check accelerometer and handle, and try again."
        raise DeviceError("The device was not compared", explanation, advice) from error


def judge_last_check(info: DeviceInfo, required: bool = False) -> DeviceFinding:
    """Judge whether this device passed its check today, as a finding before a sitting: a warning where it did not.

    required: whether the protocol requires a passed check; then DeviceError is raised instead of the warning.
    """
    finding = _find_last_check(info)
    if required and not finding.fine:
        title = "The sitting did not begin: its protocol requires a passed daily check"
        raise DeviceError(title, f"Daily check: {finding.value}.", finding.advice)
    return finding


def _find_last_check(info: DeviceInfo) -> DeviceFinding:
    """Find the newest check of this device and describe it as a finding, fine only if it was passed today (local date)
    and compared with the present baseline; "none yet" without a check. Unreadable files are skipped, and those dated on
    a later day, by a clock that was set back since."""
    local_date = split_time_in_zone(datetime.now(UTC).isoformat(), convert_to_machine_zone)[0]
    device_option = info.name.replace(".", "")
    advice = f"With no hand on the handle: hapteq doctor --device {device_option} --daily."
    for path in sorted((get_device_folder() / CHECK_FOLDER).glob("*.json"), reverse=True):
        try:
            check = read_daily_check(path)
        except StudyError:
            continue
        check_date = split_time_in_zone(check.utc, convert_to_machine_zone)[0]
        if (check.device, check.details) != (info.name, info.details) or check_date > local_date:
            continue
        time_and_path = f"{format_time_in_zone(check.utc, convert_to_machine_zone)}, {path}"
        if check_date != local_date:
            return DeviceFinding(
                "Daily check", f"none today; the last one was {time_and_path}", False, advice, warning=True
            )
        if check.baseline_sha256 != _find_baseline_digest(info):
            status_text = f"none since it was accepted anew; the last one was {time_and_path}"
            return DeviceFinding("Daily check", status_text, False, advice, warning=True)
        if not check.changes:
            return DeviceFinding("Daily check", f"it broke off ({time_and_path})", False, advice, warning=True)
        if check.passed:
            return DeviceFinding("Daily check", f"nothing changed since the acceptance ({time_and_path})", fine=True)
        changed_kinds = ", ".join(dict.fromkeys(str(change["kind"]) for change in check.changes if change["changed"]))
        status_text = (
            f"{changed_kinds} changed since the acceptance"
            if changed_kinds
            else "measured too inaccurately to detect a change"
        )
        return DeviceFinding("Daily check", f"{status_text} ({time_and_path})", False, advice, warning=True)
    return DeviceFinding("Daily check", "none yet", False, advice, warning=True)


def _find_baseline_digest(info: DeviceInfo) -> str:
    """Find the SHA-256 of the baseline of this device's acceptance; empty where it has none or is not accepted now."""
    try:
        return find_accepted_baseline(info, datetime.now(UTC).date())[1]
    except DeviceError:
        return ""


def _read_baseline(info: DeviceInfo, protocol: RecordingProtocol) -> tuple[Recording, str]:
    """Read the recording of this device's acceptance, and its SHA-256. Raises DeviceError where there is none, or it is
    not comparable with a recording by this protocol."""
    baseline_name, baseline_sha256 = find_accepted_baseline(info, datetime.now(UTC).date())
    acceptance_advice = (
        f"Accept it anew: hapteq doctor --device {info.name.replace('.', '')} --timing 60 --accept 'NAME'."
    )
    if not baseline_name:
        raise DeviceError(
            "There is nothing to compare with",
            "The device was accepted without a recording (no accelerometer).",
            acceptance_advice,
        )
    path = get_device_folder() / baseline_name
    if not path.is_file() or compute_sha256(path) != baseline_sha256:
        raise DeviceError(
            "There is nothing to compare with", f"{path} is gone, or is not what was accepted.", acceptance_advice
        )
    baseline = read_recording(path)
    if baseline.meta["provenance"]["protocol_hash"] != hash_protocol(protocol):
        explanation = f"{path} was played by another version of the protocol {protocol.name!r}."
        raise DeviceError("There is nothing to compare with", explanation, acceptance_advice)
    return baseline, baseline_sha256


def _plan_recording(device_name: str, folder_name: str) -> RecordingPlan:
    """Plan a recording by the shipped protocol, at the centre and with seed 1, into a new file of the folder
    `folder_name` in `get_device_folder()`. The folder is created."""
    recording_folder = get_device_folder() / folder_name
    recording_folder.mkdir(parents=True, exist_ok=True)
    return RecordingPlan(
        _read_protocol(), device_name, (0.0, 0.0, 0.0), 1, recording_folder / f"{device_name}_{_format_time_stamp()}.h5"
    )


def _read_protocol() -> RecordingProtocol:
    """Read the shipped recording protocol of the check."""
    return read_recording_protocol(CHECK_PROTOCOL_NAME).protocol


def _format_time_stamp() -> str:
    """Format the present UTC time (YYYYMMDDTHHMMSSZ), so that file names sort by time."""
    return datetime.now(UTC).strftime("%Y%m%dT%H%M%SZ")


def _open_free_device(plan: RecordingPlan) -> Device:
    """Open the device with the settings of a recording, without a hand on the handle."""
    return open_device(plan.device, make_recording_settings(plan), RealClock(), plan.seed)


def _convert_change_to_json(change: "Change") -> dict[str, Any]:
    """Convert a change to JSON values; NaN in `accepted`, `today` or `error` becomes None, because JSON has no NaN."""
    missing_values = {
        field_name: None for field_name in ("accepted", "today", "error") if math.isnan(getattr(change, field_name))
    }
    return asdict(change) | missing_values
