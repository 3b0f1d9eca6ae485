"""Command `hapteq export`: writes the trials of a study as Psych-DS, BIDS, MATLAB or CSV files."""

import json
from pathlib import Path
from typing import Annotated, Literal

import typer

from study.cli.results import JsonOption


def export(
    data: Annotated[Path, typer.Argument(help="Folder of sessions, or one session.")],
    out: Annotated[Path, typer.Option(help="Folder to write; it must not be there yet, or be empty.")],
    export_format: Annotated[
        Literal["psych-ds", "bids", "mat", "csv"],
        typer.Option(
            "--format",
            "--form",
            help="Psych-DS (a table per session, described), BIDS behaviour, a MATLAB file, or one table as CSV.",
        ),
    ] = "psych-ds",
    protocol: Annotated[
        str | None, typer.Option(help="Which protocol's sessions, where the folder holds several.")
    ] = None,
    free_text: Annotated[
        bool,
        typer.Option(
            "--free-text",
            help="Also what participants wrote in their own words; it may be about health, or name a person.",
        ),
    ] = False,
    as_json: JsonOption = False,
) -> None:
    """Write all trials with their protocol, seeds and versions. `hapteq analyze` reads psych-ds and csv."""
    from study.workflows.results.collect_sessions import collect_sessions
    from study.workflows.results.export_study import export_study

    export_result = export_study(collect_sessions(data, protocol), data, out, export_format, free_text)
    if as_json:
        typer.echo(
            json.dumps(
                {"out": str(export_result.out), "files": export_result.files, "trials": export_result.trials}, indent=2
            )
        )
        return
    for remark in export_result.left_out:
        typer.echo(f"Left out: {remark}", err=True)
    typer.echo(f"{export_result.out}: {export_result.trials} trials in {len(export_result.files)} files")
