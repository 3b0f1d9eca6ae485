"""Command `hapteq rehearse`: run the whole study with simulated participants.

The sessions run on worker processes or a cluster (`study.workflows.session.rehearse_study`), and their data are
analysed as those of a study. Raises StudyError where protocol, model or observer cannot be used, or where the folder
holds another rehearsal.
"""

from pathlib import Path
from typing import Annotated

import typer

from study.cli.results import JsonOption, print_results
from study.cli.scheduler import SchedulerOption, connect_cluster
from study.cli.seed import check_seed
from study.cli.session_options import ModelOption, ProtocolOption, choose_protocol


def rehearse(
    subjects: Annotated[int, typer.Option(min=1, max=1000, help="How many simulated participants.")] = 10,
    out: Annotated[Path, typer.Option(help="Folder of the sessions and the report.")] = Path("rehearsal"),
    protocol: ProtocolOption = None,
    seed: Annotated[int, typer.Option(min=0, callback=check_seed, help="Seed of the population and of all draws.")] = 1,
    workers: Annotated[int, typer.Option(min=1, max=64, help="Processes at work at once.")] = 2,
    scheduler: SchedulerOption = None,
    model: ModelOption = None,
    observer: Annotated[
        str,
        typer.Option(
            help="Who takes it: person (a population with individual thresholds), the same people as delivered (they "
            "feel what the device delivers), repeating (ask again when unsure) or criterion_drift; or one observer of "
            "hapteq study for all."
        ),
    ] = "person",
    as_json: JsonOption = False,
) -> None:
    """Let simulated participants take the whole study, with its report. Interrupted, the same command continues."""
    from study.cli.progress import show_bar
    from study.store.formats.protocol_files import read_study_protocol
    from study.workflows.results.analysis_files import ANALYSIS_NAME
    from study.workflows.results.analyze_data import analyze_data
    from study.workflows.session.equalize_stimuli import check_model_for_protocol
    from study.workflows.session.rehearse_study import Rehearsal, make_rehearsed_observer, rehearse_study

    source = read_study_protocol(choose_protocol(protocol, model), out)
    check_model_for_protocol(source.protocol, model)
    rehearsal = Rehearsal(
        source.protocol, source.text, subjects, seed, data=out, model=model, observer=observer, locked=source.locked
    )
    make_rehearsed_observer(rehearsal, 0)  # raises StudyError for an unknown observer before any session is run
    with (
        connect_cluster(scheduler) as cluster,
        show_bar(f"{subjects} simulated participants", total=subjects) as advance,
    ):
        rehearse_study(rehearsal, cluster or workers, advance)
    print_results(analyze_data(out, out / ANALYSIS_NAME), as_json)
