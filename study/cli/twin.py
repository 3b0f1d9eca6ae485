"""Command `hapteq twin`: fits the nominal mechanical model of a device (its digital twin) to its responses.

Options, notice before a real device moves, and output; `study.workflows.diagnosis.write_twin` records and fits.
"""

from pathlib import Path
from typing import Annotated

import typer

from study.cli.motion_notice import announce_motion
from study.cli.results import JsonOption, print_notes, print_summary
from study.cli.seed import check_seed
from study.cli.session_options import DeviceOption, HandsOffOption


def twin(
    out: Annotated[Path, typer.Option(help="The mechanical model to write, MODEL.toml.")],
    device: DeviceOption = "simulated",
    seed: Annotated[int, typer.Option(min=0, callback=check_seed, help="Seed of the simulated device's noise.")] = 1,
    protocol: Annotated[
        str, typer.Option(help="Recording protocol with multisines along x, y and z, or a file.")
    ] = "multisine",
    band: Annotated[tuple[float, float], typer.Option(help="Band to fit, low and high in hertz.")] = (3.0, 60.0),
    calibration: Annotated[
        Path | None,
        typer.Option(help="Calibration of the linkage, CAL.h5 of `hapteq calibrate`: how the inertia changes."),
    ] = None,
    hands_off: HandsOffOption = False,
    as_json: JsonOption = False,
) -> None:
    """Excite the device well above its friction at two levels, fit masses, dampers, cables and modes from the command
    to the acceleration, subtract the damping that friction adds, and write the model with its tolerances. No person may
    hold the handle; from a script, a real device moves with --hands-off only.

    With --calibration the model also says how the inertia changes with the position, and the simulated device has the
    linkage and the masses of the calibrated one.
    """
    from functools import partial

    from study.cli.progress import show_share
    from study.workflows.diagnosis.twin_summary import format_twin_lines, summarise_twin
    from study.workflows.diagnosis.write_twin import TwinPlan, check_output_and_band, write_twin

    plan = TwinPlan(out, device, seed, protocol, band, calibration)
    check_output_and_band(plan)
    with show_share("Twin") as on_progress:
        fitted_twin = write_twin(plan, on_progress, partial(announce_motion, hands_off=hands_off))
    print_summary(summarise_twin(fitted_twin), (str(out), *format_twin_lines(fitted_twin)), as_json)
    print_notes(fitted_twin.notes)
