"""`hapteq sessions`: what lies in a data folder."""

import json
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from study.cli.results import JsonOption
from study.cli.study import DataOption


def sessions(
    data: DataOption = Path("data"),
    remarks: Annotated[bool, typer.Option("--remarks", help="Also why a session cannot be used.")] = False,
    as_json: JsonOption = False,
) -> None:
    """List all sessions, latest first: how they stand, and how far they are."""
    from study.local_clock import machine_zone
    from study.session.local_time import local_time
    from study.tui.standing_words import standing_words
    from study.workflows.list_sessions import session_lines

    lines = session_lines(data)
    if as_json:
        typer.echo(json.dumps([asdict(line) for line in lines], indent=2))
        return
    if not lines:
        typer.echo(f"No sessions in {data}. hapteq study begins one, hapteq rehearse makes simulated ones.", err=True)
        return
    longest = max(len("session"), *(len(line.name) for line in lines))
    typer.echo(f"{'session':{longest}}  {'standing':12}  {'begun':23}  {'runs':>5}  {'answers':>7}  protocol")
    for line in lines:
        known, begun = line.runs > 0, local_time(line.begun_utc, machine_zone)
        typer.echo(
            f"{line.name:{longest}}  {standing_words(line.standing):12}  {begun:23}  "
            f"{f'{line.runs_done}/{line.runs}' if known else '':>5}  {line.answers if known else '':>7}  "
            f"{line.protocol}{f' ({line.observer})' if line.observer else ''}".rstrip()
        )
        if remarks and line.remark:
            typer.echo(f"    {line.remark}")
