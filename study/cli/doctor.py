"""Command `hapteq doctor`: checks whether this computer and its device are fit for a study.

Checks, in this order, the installation, the device with its sensor, and the timing of the 1 kHz loop, and prints the
findings; by option it also calibrates the device or its accelerometer, accepts the device for use with a hand, or runs
the daily check.
"""

import json
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from study.cli.motion_notice import announce_motion, require_confirmation
from study.cli.results import JsonOption
from study.cli.session_options import DataOption, DeviceOption, HandsOffOption
from study.errors import WrongUseError

if TYPE_CHECKING:
    from study.session.views.participant_views import DeviceFinding
    from study.workflows.checks.daily_check import MotionCallbacks
    from study.workflows.checks.examine_setup import Examination

NAME_COLUMN_WIDTH = 17
"""Least width of the column of a finding's name, in characters; a longer name shifts its line. Chosen."""
CALIBRATION_TIMEOUT_S = 60.0
"""Longest wait (s) until the handle is in its calibration position. Chosen: a minute suffices to move it by hand."""


def _check_operator(operator: str | None) -> str | None:
    """Return the operator's name unchanged (typer callback). Raises WrongUseError for a blank one, as from an empty
    variable of a script: an acceptance is signed."""
    if operator is not None and not operator.strip():
        raise WrongUseError(
            "The acceptance needs a name",
            "--accept is followed by an empty text.",
            "Give the name of the person who checked the device, such as --accept 'Ada Lovelace'.",
            saved="Nothing moved.",
        )
    return operator


TimingOption = Annotated[
    float,
    typer.Option(min=0, max=500, help="Seconds for which the 1 kHz loop is timed, with zero force; 0: not at all."),
]
CalibrateOption = Annotated[
    bool, typer.Option("--calibrate", help="First wait until the handle is put into its calibration position.")
]
AcceptOption = Annotated[
    str | None,
    typer.Option(
        metavar="OPERATOR",
        callback=_check_operator,
        help="With no hand on the handle: record how it answers now, prove with 0.5 N that it lets go, and unlock it "
        "for hands.",
    ),
]
DailyOption = Annotated[
    bool,
    typer.Option(
        "--daily", help="With no hand on the handle: does it answer as when it was accepted? It moves for 1.5 minutes."
    ),
]
SensorOption = Annotated[
    str | None,
    typer.Option(metavar="PORT", help="Only this: lay the accelerometer on this serial line down in six positions."),
]
KeepOption = Annotated[
    bool, typer.Option("--keep", help="Put what --calibrate-sensor finds into the lab's file, not only on the screen.")
]
BaudOption = Annotated[int, typer.Option(min=1, help="Of the accelerometer's serial line.")]


def doctor(
    device: DeviceOption = "simulated",
    timing: TimingOption = 2.0,
    data: DataOption = Path("data"),
    calibrate: CalibrateOption = False,
    accept: AcceptOption = None,
    daily: DailyOption = False,
    calibrate_sensor: SensorOption = None,
    baud: BaudOption = 2_000_000,
    keep: KeepOption = False,
    hands_off: HandsOffOption = False,
    as_json: JsonOption = False,
) -> None:
    """Check the installation, the device with its sensor, and the 1 kHz timing. Nothing moves, unless --accept or
    --daily requires it: then this is announced, and confirmed in a terminal or by --hands-off."""
    from contextlib import nullcontext

    from study.cli.progress import show_bar
    from study.workflows.checks.check_installation import detect_terminal
    from study.workflows.checks.examine_setup import examine_setup

    if calibrate_sensor is not None:
        _calibrate_accelerometer(calibrate_sensor, baud, keep)
        return
    _prepare_device(device, calibrate, daily, daily or accept is not None, hands_off)
    with show_bar("Timing the loop (s)", total=timing) if timing else nullcontext(lambda result: None) as show_timed_s:
        examination = examine_setup(device, data, timing, detect_terminal(), on_progress=show_timed_s)
    if as_json:
        typer.echo(json.dumps(_make_document(examination), indent=2))
    else:
        _print_findings(examination)
    if accept is not None:
        _accept_device(device, examination, accept, hands_off)
    if examination.exit_code:
        raise typer.Exit(examination.exit_code)
    if daily:
        _run_daily_check(device, examination, as_json, hands_off)


def _prepare_device(device: str, calibrate: bool, daily: bool, will_move: bool, hands_off: bool) -> None:
    """Check, before the examination, that the options are allowed, and calibrate the device if this is requested.
    will_move: whether --accept or --daily makes the device move. Raises WrongUseError where its motion cannot be
    confirmed, or the device is not a real one (--daily), and DeviceError where the calibration fails."""
    from study.devices.opening import needs_real_time

    if daily:
        from study.workflows.checks.daily_check import require_acceptable_device

        require_acceptable_device(device)
    if will_move and needs_real_time(device):
        require_confirmation(hands_off)
    if calibrate:
        _calibrate_device(device)


def _accept_device(device: str, examination: "Examination", operator: str, hands_off: bool) -> None:
    """Record the acceptance of the device for use with a hand, signed by `operator`, and print a sentence about it."""
    from study.workflows.checks.examine_setup import accept_examined_device

    with _announce_and_show_motion(hands_off) as motion_callbacks:
        sentence = accept_examined_device(device, examination, operator, motion_callbacks)
    typer.echo(sentence, err=True)


def _run_daily_check(device: str, examination: "Examination", as_json: bool, hands_off: bool) -> None:
    """Run the daily check of the device against its acceptance, and print the findings and the path of the file; with
    as_json only the path, on stderr. Raises typer.Exit where a finding is not fine."""
    from study.errors import ExitCode
    from study.workflows.checks.daily_check import check_today
    from study.workflows.checks.examine_setup import require_sensor

    require_sensor(examination)
    with _announce_and_show_motion(hands_off) as motion_callbacks:
        daily_check = check_today(device, motion_callbacks)
    if not as_json:
        typer.echo("Daily check")
        for finding in daily_check.findings:
            _print_finding(finding)
    typer.echo(str(daily_check.file), err=as_json)
    if not all(finding.fine for finding in daily_check.findings):
        raise typer.Exit(ExitCode.DEVICE)


@contextmanager
def _announce_and_show_motion(hands_off: bool) -> "Iterator[MotionCallbacks]":
    """Context manager that yields the callbacks of a motion: the notice to be confirmed, and a bar of the seconds."""
    from functools import partial

    from study.cli.progress import show_late_bar
    from study.workflows.checks.daily_check import MotionCallbacks, compute_play_duration_s

    with show_late_bar("The device moves (s)", total=round(compute_play_duration_s())) as show_played_s:
        yield MotionCallbacks(partial(announce_motion, hands_off=hands_off), show_played_s)


def _calibrate_device(device: str) -> None:
    """Ask for the handle in its calibration position, and wait until the device is calibrated, at most
    `CALIBRATION_TIMEOUT_S`. Raises DeviceError where it is not."""
    from study.devices.opening import calibrate_device

    instruction = "Bring the handle into its calibration position, as the device's manual shows, and leave it there"
    typer.echo(f"{instruction} (within {CALIBRATION_TIMEOUT_S:g} s).", err=True)
    calibrate_device(device, CALIBRATION_TIMEOUT_S)


def _calibrate_accelerometer(port: str, baud: int, keep: bool) -> None:
    """Calibrate the accelerometer on a serial port by gravity in six positions, and print the TOML table, which is
    written into the lab's file if `keep`. baud: bit/s. Raises DeviceError, and KeyboardInterrupt at the end of the
    input."""
    from study.devices.opening import calibrate_accelerometer, save_accelerometer_calibration

    def await_position(position: str, previous_mean: tuple[float, float, float] | None) -> None:
        """Print the mean of the previous position, and wait for Enter; see `six_positions.AwaitPosition`."""
        if previous_mean is not None:
            typer.echo(f"  read {', '.join(f'{value:.0f}' for value in previous_mean)}", err=True)
        typer.echo(f"Lay the sensor down with {position}, let go of it, and press Enter. ", err=True, nl=False)
        if not sys.stdin.readline():
            raise KeyboardInterrupt

    calibration_toml = calibrate_accelerometer(port, baud, await_position)
    if keep:
        typer.echo(f"Written into {save_accelerometer_calibration(calibration_toml)}:", err=True)
    else:
        typer.echo("Put this into the device's file (docs/hardware.md), or do it again with --keep:", err=True)
    typer.echo(calibration_toml)


def _print_findings(examination: "Examination") -> None:
    """Print all findings under the titles of their sections, then a summary."""
    timing_report = examination.timing
    findings_by_section = {
        "Installation": examination.installation,
        "Device": examination.device.findings,
        "Timing": timing_report.findings if timing_report is not None else (),
    }
    for title, findings in findings_by_section.items():
        if findings:
            typer.echo(title)
        for finding in findings:
            _print_finding(finding)
    typer.echo(_summarise_findings(examination.findings))


def _summarise_findings(findings: "tuple[DeviceFinding, ...]") -> str:
    """Summarise in one or two sentences how many findings are not fine, and how many of these are warnings."""
    failed_count = sum(not finding.fine for finding in findings)
    warning_count = sum(finding.warning for finding in findings)
    if not failed_count:
        return f"All {len(findings)} checks are fine."
    warning_note = (
        f" {warning_count} of them {'is a warning' if warning_count == 1 else 'are warnings'}." if warning_count else ""
    )
    return f"{failed_count} of {len(findings)} checks are not fine.{warning_note}"


def _print_finding(finding: "DeviceFinding") -> None:
    """Print a finding as a line, and its advice, if any, on a second line."""
    verdict = "fine" if finding.fine else "WRONG" if finding.wrong else "WARN"
    typer.echo(f"  {verdict:<5}  {finding.name:<{NAME_COLUMN_WIDTH}}  {finding.value}")
    if finding.advice:
        typer.echo(f"         {'':<{NAME_COLUMN_WIDTH}}  {finding.advice}")


def _make_document(examination: "Examination") -> dict[str, Any]:
    """Make the JSON document of --json; its `timing` is None where the timing was not measured."""
    timing_report = examination.timing
    document = {
        "fine": all(finding.fine for finding in examination.findings),
        "installation": [asdict(finding) for finding in examination.installation],
        "device": asdict(examination.device),
        "timing": None,
    }
    if timing_report is not None:
        health = asdict(timing_report.health) | {"fault": timing_report.health.fault.name.lower()}
        document["timing"] = asdict(timing_report) | {"health": health}
    return document
