"""Command `hapteq model`: fit a mechanical model (masses, dampers, springs) to recordings of a device.

Options and output only; `study.workflows.diagnosis.fit_first_model` fits the model and writes the file.
"""

from pathlib import Path
from typing import Annotated

import typer

from study.cli.diagnose import ForceConstantOption
from study.cli.results import JsonOption, print_notes, print_summary


def model(
    recordings: Annotated[list[Path], typer.Argument(help="Recordings of one device.", metavar="REC.h5...")],
    out: Annotated[Path, typer.Option(help="The mechanical model to write, MODEL.toml.")],
    structure: Annotated[str, typer.Option(help="auto, mass-spring, two-mode, gravity, massless or motor.")] = "auto",
    force_constant: ForceConstantOption = None,
    as_json: JsonOption = False,
) -> None:
    """Fit masses, dampers and springs to recordings, and write them with tolerances.

    `auto` compares structures by their error on held-out data, and states the reason for its choice.
    """
    from study.cli.progress import show_share
    from study.workflows.diagnosis.fit_first_model import (
        FirstModelPlan,
        fit_and_write_first_model,
        format_first_model,
        summarise_first_model,
    )

    plan = FirstModelPlan(tuple(recordings), out, structure, tuple(force_constant or ()))
    with show_share("Model") as on_progress:
        fitted_model = fit_and_write_first_model(plan, on_progress)
    print_summary(summarise_first_model(fitted_model), format_first_model(fitted_model), as_json)
    print_notes(fitted_model.remarks)
