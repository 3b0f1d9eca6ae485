"""`hapteq doctor`: is this computer, and the device at it, fit for a study?"""

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

if TYPE_CHECKING:
    from study.session.views.participant_views import DeviceFinding
    from study.workflows.checks.daily_check import MotionCallbacks
    from study.workflows.checks.examine_setup import Examination

NAME_WIDTH = 17
"""Columns of a finding's name."""
CALIBRATION_S = 60.0
"""Longest wait for a calibration by hand (s)."""


TimingOption = Annotated[
    float, typer.Option(min=0, max=500, help="How long the 1 kHz loop is timed, with zero force; 0: not at all.")
]
CalibrateOption = Annotated[
    bool, typer.Option("--calibrate", help="First wait until the handle is put into its calibration position.")
]
AcceptOption = Annotated[
    str | None,
    typer.Option(
        metavar="OPERATOR",
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
        _calibrate_sensor(calibrate_sensor, baud, keep)
        return
    _prepare(device, calibrate, daily, daily or accept is not None, hands_off)
    with show_bar("Timing the loop (s)", total=timing) if timing else nullcontext(lambda result: None) as show:
        examination = examine_setup(device, data, timing, detect_terminal(), on_progress=show)
    if as_json:
        typer.echo(json.dumps(_make_document(examination), indent=2))
    else:
        _print_findings(examination)
    if accept is not None:
        _accept(device, examination, accept, hands_off)
    if examination.exit_code:
        raise typer.Exit(examination.exit_code)
    if daily:
        _check_today(device, examination, as_json, hands_off)


def _prepare(device: str, calibrate: bool, daily: bool, moves: bool, hands_off: bool) -> None:
    """moves: a real device will move; where that cannot be confirmed, it is refused before all the checks."""
    from study.devices.opening import needs_real_time

    if daily:
        from study.workflows.checks.daily_check import require_acceptable_device

        require_acceptable_device(device)
    if moves and needs_real_time(device):
        require_confirmation(hands_off)
    if calibrate:
        _calibrate(device)


def _accept(device: str, examination: "Examination", operator: str, hands_off: bool) -> None:
    from study.workflows.checks.examine_setup import accept

    with _show_motion(hands_off) as motion_callbacks:
        sentence = accept(device, examination, operator, motion_callbacks)
    typer.echo(sentence, err=True)


def _check_today(device: str, examination: "Examination", as_json: bool, hands_off: bool) -> None:
    """What changed since the acceptance, after the rest was found fine. With --json, only the file, on stderr."""
    from study.errors import ExitCode
    from study.workflows.checks.daily_check import check_today
    from study.workflows.checks.examine_setup import require_sensor

    require_sensor(examination)
    with _show_motion(hands_off) as motion_callbacks:
        checked = check_today(device, motion_callbacks)
    if not as_json:
        typer.echo("Daily check")
        for finding in checked.findings:
            _print_finding(finding)
    typer.echo(str(checked.file), err=as_json)
    if not all(finding.fine for finding in checked.findings):
        raise typer.Exit(ExitCode.DEVICE)


@contextmanager
def _show_motion(hands_off: bool) -> "Iterator[MotionCallbacks]":
    from functools import partial

    from study.cli.progress import show_late_bar
    from study.workflows.checks.daily_check import MotionCallbacks, compute_play_duration_s

    with show_late_bar("The device moves (s)", total=round(compute_play_duration_s())) as show:
        yield MotionCallbacks(partial(announce_motion, hands_off=hands_off), show)


def _calibrate(device: str) -> None:
    from study.devices.opening import calibrate_device

    instruction = "Bring the handle into its calibration position, as the device's manual shows, and leave it there"
    typer.echo(f"{instruction} (within {CALIBRATION_S:g} s).", err=True)
    calibrate_device(device, CALIBRATION_S)


def _calibrate_sensor(port: str, baud: int, keep: bool) -> None:
    from study.devices.opening import calibrate_accelerometer, save_accelerometer_calibration

    def lay_down(position: str, heard: tuple[float, float, float] | None) -> None:
        if heard is not None:
            typer.echo(f"  read {', '.join(f'{value:.0f}' for value in heard)}", err=True)
        typer.echo(f"Lay the sensor down with {position}, let go of it, and press Enter. ", err=True, nl=False)
        if not sys.stdin.readline():
            raise KeyboardInterrupt

    table = calibrate_accelerometer(port, baud, lay_down)
    if keep:
        typer.echo(f"Written into {save_accelerometer_calibration(table)}:", err=True)
    else:
        typer.echo("Put this into the device's file (docs/hardware.md), or do it again with --keep:", err=True)
    typer.echo(table)


def _print_findings(examination: "Examination") -> None:
    timing = examination.timing
    parts = {
        "Installation": examination.installation,
        "Device": examination.device.findings,
        "Timing": timing.findings if timing is not None else (),
    }
    for title, findings in parts.items():
        if findings:
            typer.echo(title)
        for finding in findings:
            _print_finding(finding)
    typer.echo(_summarise(examination.findings))


def _summarise(findings: "tuple[DeviceFinding, ...]") -> str:
    not_fine, warnings = sum(not finding.fine for finding in findings), sum(finding.warning for finding in findings)
    if not not_fine:
        return f"All {len(findings)} checks are fine."
    warning_note = f" {warnings} of them {'is a warning' if warnings == 1 else 'are warnings'}." if warnings else ""
    return f"{not_fine} of {len(findings)} checks are not fine.{warning_note}"


def _print_finding(finding: "DeviceFinding") -> None:
    verdict = "fine" if finding.fine else "WRONG" if finding.wrong else "WARN"
    typer.echo(f"  {verdict:<5}  {finding.name:<{NAME_WIDTH}}  {finding.value}")
    if finding.advice:
        typer.echo(f"         {'':<{NAME_WIDTH}}  {finding.advice}")


def _make_document(examination: "Examination") -> dict[str, Any]:
    timing = examination.timing
    document = {
        "fine": all(finding.fine for finding in examination.findings),
        "installation": [asdict(finding) for finding in examination.installation],
        "device": asdict(examination.device),
        "timing": None,
    }
    if timing is not None:
        health = asdict(timing.health) | {"fault": timing.health.fault.name.lower()}
        document["timing"] = asdict(timing) | {"health": health}
    return document
