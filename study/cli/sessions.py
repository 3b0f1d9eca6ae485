"""Command `hapteq sessions`: list the sessions in a data folder as a table, or as JSON."""

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

    session_lines = list_session_lines(data)
    if as_json:
        typer.echo(json.dumps([asdict(line) for line in session_lines], indent=2))
        return
    if not session_lines:
        typer.echo(f"No sessions in {data}. hapteq study begins one, hapteq rehearse makes simulated ones.", err=True)
        return
    for text_line in _format_table(session_lines, remarks, read_terminal_width()):
        typer.echo(text_line)


def _format_table(
    session_lines: "tuple[SessionLine, ...]", with_remarks: bool, width_cells: int | None
) -> Iterator[str]:
    """Yield the lines of the table: header, then each session, with its remark below where requested. width_cells:
    width of the terminal in character cells; None: no limit. Times are in the computer's time zone."""
    from study.local_clock import convert_to_machine_zone
    from study.session.views.local_time import format_times_in_zone
    from study.tui.session_status import format_status
    from study.tui.text_rows import align_row_lines

    utc_offset, begun_times = format_times_in_zone(
        [session.begun_utc for session in session_lines], convert_to_machine_zone
    )
    header = ("session", "standing", f"begun ({utc_offset})" if utc_offset else "begun", "runs", "answers", "protocol")
    rows = [
        (
            session.name,
            format_status(session.standing),
            begun_time,
            f"{session.runs_done}/{session.runs}" if session.runs else "",
            str(session.answers) if session.runs else "",
            f"{session.protocol}{f' ({session.observer})' if session.observer else ''}",
        )
        for session, begun_time in zip(session_lines, begun_times, strict=True)
    ]
    header_lines, *row_lines = align_row_lines((header, *rows), width_cells)
    yield from header_lines
    for session, text_lines in zip(session_lines, row_lines, strict=True):
        yield from text_lines
        if with_remarks and session.remark:
            yield f"    {session.remark}"
