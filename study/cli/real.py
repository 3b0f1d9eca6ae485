"""Command `hapteq real`: diagnoses a folder of recordings of real devices, and writes one page of results.

Options and output only; `study.evaluation.real.real_recordings` diagnoses the recordings.
"""

from pathlib import Path
from typing import Annotated

import typer

from study.cli.results import JsonOption
from study.cli.scheduler import SchedulerOption, connect_cluster
from study.cli.seed import check_seed


def real(
    folder: Annotated[
        Path, typer.Argument(metavar="FOLDER", help="Its sub-folders hold recordings, and maps of them.")
    ],
    out: Annotated[Path, typer.Option(help="Folder of the page, the table, the figures and every diagnosis.")],
    seconds: Annotated[
        float | None,
        typer.Option(
            min=1.0,
            help="Processor time for a sub-folder, after which its searches end. [default: they end by a count of "
            "evaluations, the same on every machine]",
        ),
    ] = None,
    inject: Annotated[
        int,
        typer.Option(
            min=0,
            max=10_000,
            help="Number of blind cases, half of them without a fault: drawn, sealed, injected, diagnosed.",
        ),
    ] = 0,
    seed: Annotated[int, typer.Option(min=0, callback=check_seed, help="Seed of the draw of these cases.")] = 1,
    scheduler: SchedulerOption = None,
    as_json: JsonOption = False,
) -> None:
    """Diagnose a folder of real recordings: the effects that are named, what remains unexplained, and possible
    objections.

    Maps in the folder of the recordings are used, else those that come with hapteq. After an interruption, the same
    command continues.
    """
    import json

    from analysis.diagnosis.real_answer.real_answer import real_answer_to_json
    from study.cli.progress import show_steps
    from study.evaluation.real.real_recordings import RealPlan, diagnose_folder
    from study.evaluation.real.real_summary import format_real_lines

    with connect_cluster(scheduler) as cluster, show_steps("Real recordings") as show_step:
        diagnosed_folder = diagnose_folder(RealPlan(folder, out, seconds, inject, seed), show_step, executor=cluster)
    if as_json:
        typer.echo(json.dumps([real_answer_to_json(answer) for answer in diagnosed_folder.results.answers], indent=2))
    else:
        typer.echo("\n".join(format_real_lines(diagnosed_folder)))
