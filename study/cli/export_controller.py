"""Command `hapteq export-controller`: write the feedforward controllers of an identified model as C sources.

Options and output only; `study.workflows.equalizer.controller.export_controller` writes the files.
"""

from pathlib import Path
from typing import Annotated

import typer

from study.cli.results import JsonOption, print_notes, print_summary


def export_controller(
    model: Annotated[Path, typer.Argument(metavar="MODEL.h5", help="An identified model.")],
    out: Annotated[Path, typer.Option(help="The folder to write, a new one.")],
    transient: Annotated[
        Path | None, typer.Option(help="Wanted accelerations (time_s,ax,ay,az) to be turned; else a tap along z.")
    ] = None,
    preview: Annotated[
        float, typer.Option(min=0.0, help="How long ahead a stream is known, in ms; it is played with this delay.")
    ] = 200.0,
    weight: Annotated[float, typer.Option(min=0.0, help="Weight of |force|² against |error|², (m/s² per N)².")] = 1e-3,
    cap: Annotated[float, typer.Option(min=0.001, help="Highest force, in newtons.")] = 3.0,
    as_json: JsonOption = False,
) -> None:
    """Write stored gains, rotation basis and band split as a C11 header with tick functions, an example loop, and a
    check that compares them with Python.

    For CHAI3D, ROS 2 and other loops: docs/controller.md.
    """
    from study.workflows.equalizer.controller.export_controller import (
        ControllerPlan,
        describe_export,
        export_controller,
        make_controller_settings,
        summarise_export,
        warn_of_export,
    )

    settings = make_controller_settings(weight, preview / 1000, cap)
    exported = export_controller(ControllerPlan(model, out, transient, settings))
    print_notes(warn_of_export(exported))
    print_summary(summarise_export(exported), describe_export(exported), as_json)
