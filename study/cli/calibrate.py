"""Command `hapteq calibrate`: reads Jacobian, inertia and gravity of a device's linkage over its workspace."""

from pathlib import Path
from typing import Annotated

import typer

from study.cli.results import JsonOption, print_notes, print_summary
from study.cli.session_options import DeviceOption


def calibrate(
    out: Annotated[Path, typer.Option(help="The calibration to write, CAL.h5.")],
    device: DeviceOption = "simulated",
    radius: Annotated[float, typer.Option(help="Of the grid around the axis x, in metres.")] = 0.05,
    depth: Annotated[float, typer.Option(help="Of the grid before and behind the centre, in metres.")] = 0.04,
    as_json: JsonOption = False,
) -> None:
    """Read Jacobian, inertia and gravity at 185 positions from the device's library, and compare them about the
    linkage's three mirror lines. The library computes them: nothing moves, the device stays braked.

    `hapteq twin --calibration CAL.h5` and `--device simulated:CAL.h5` use the result. (Another calibration, that of the
    encoders after each power-up, is `hapteq doctor --calibrate`.)
    """
    from study.cli.progress import show_share
    from study.workflows.recording.calibrate_linkage import (
        CalibrationPlan,
        calibrate_linkage,
        format_calibration_lines,
        summarise_calibration,
    )

    plan = CalibrationPlan(out, device, radius, depth)
    with show_share("Calibration") as on_progress:
        calibration = calibrate_linkage(plan, on_progress)
    print_summary(summarise_calibration(calibration), (str(out), *format_calibration_lines(calibration)), as_json)
    print_notes(calibration.warnings)
