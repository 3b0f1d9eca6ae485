"""`hapteq sessions`: what lies in a data folder."""

import json
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from study.cli.results import JsonOption
from study.cli.screen import read_terminal_width
from study.cli.session_options import DataOption

if TYPE_CHECKING:
    from study.session.views.archive_views import SessionLine


def sessions(
    data: DataOption = Path("data"),
    remarks: Annotated[bool, typer.Option("--remarks", help="Also why a session cannot be used.")] = False,
    as_json: JsonOption = False,
) -> None:
    """List all sessions, latest first: their status and progress."""
    from study.workflows.views.view_home import list_session_lines

    lines = list_session_lines(data)
    if as_json:
        typer.echo(json.dumps([asdict(line) for line in lines], indent=2))
        return
    if not lines:
        typer.echo(f"No sessions in {data}. hapteq study begins one, hapteq rehearse makes simulated ones.", err=True)
        return
    for text in _format_table(lines, remarks, read_terminal_width()):
        typer.echo(text)


def _format_table(lines: "tuple[SessionLine, ...]", remarks: bool, width: int | None) -> Iterator[str]:
    from study.local_clock import convert_to_machine_zone
    from study.session.views.local_time import format_times_in_zone
    from study.tui.session_status import format_status
    from study.tui.text_rows import align_row_lines

    offset, begun_texts = format_times_in_zone([line.begun_utc for line in lines], convert_to_machine_zone)
    header = ("session", "standing", f"begun ({offset})" if offset else "begun", "runs", "answers", "protocol")
    rows = [
        (
            line.name,
            format_status(line.standing),
            begun_text,
            f"{line.runs_done}/{line.runs}" if line.runs else "",
            str(line.answers) if line.runs else "",
            f"{line.protocol}{f' ({line.observer})' if line.observer else ''}",
        )
        for line, begun_text in zip(lines, begun_texts, strict=True)
    ]
    titles, *row_lines = align_row_lines((header, *rows), width)
    yield from titles
    for line, texts in zip(lines, row_lines, strict=True):
        yield from texts
        if remarks and line.remark:
            yield f"    {line.remark}"
