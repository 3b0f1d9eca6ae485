"""Command `hapteq reproduce`: computes the published figures 1 to 5 again on the simulated omega.3.

Options and output only; `study.evaluation.reproduction.reproduce_paper` computes and writes the figures.
"""

from pathlib import Path
from typing import Annotated

import typer

from study.cli.results import JsonOption
from study.cli.seed import check_seed


def reproduce(
    out: Annotated[Path, typer.Option(help="Folder of the page, the figures and all that they are made from.")] = Path(
        "reproduction"
    ),
    subjects: Annotated[int, typer.Option(min=2, max=1000, help="How many simulated participants.")] = 10,
    seed: Annotated[
        int, typer.Option(min=0, callback=check_seed, help="Seed of the participants and of the sensor's noise.")
    ] = 1,
    workers: Annotated[int, typer.Option(min=1, max=64, help="Processes at work at once.")] = 2,
    as_json: JsonOption = False,
) -> None:
    """Draw the paper's figures 1 to 5, each with the values of the paper and of this run.

    Everything is simulated: device and participants. After an interruption, the same command continues.
    """
    import json

    from analysis.evaluation.reproduction.document import reproduction_to_json
    from study.cli.progress import show_bar
    from study.evaluation.reproduction.reproduce_paper import reproduce_paper
    from study.evaluation.reproduction.reproduction_plan import ReproductionPlan

    plan = ReproductionPlan(out, subjects=subjects, seed=seed, workers=workers)
    with show_bar("Reproduction (%)", total=100) as show_percent:
        written_reproduction = reproduce_paper(plan, lambda share: show_percent(round(100 * share)))
    if as_json:
        document = {
            "report": str(written_reproduction.report),
            **reproduction_to_json(written_reproduction.reproduction),
        }
        typer.echo(json.dumps(document, indent=2))
    else:
        for line in written_reproduction.lines:
            typer.echo(line)
    typer.echo(f"Report: {written_reproduction.report}", err=True)
