"""Command `hapteq note`: write a note into the log of a session, whether it runs or has ended.

`study.workflows.views.take_note` writes the note. `study.cli.watch` uses `write_note`, too.
"""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from study.cli.session_options import DataOption

if TYPE_CHECKING:
    from study.store.sessions.archive import SessionFolder


def note(
    session: Annotated[str, typer.Argument(help="Session folder, or its name in the data folder.")],
    text: Annotated[str, typer.Argument(help="What is to be noted; no names.")],
    adverse: Annotated[
        bool, typer.Option("--adverse", help="Something happened to the participant: pain, numbness, a fright.")
    ] = False,
    data: DataOption = Path("data"),
) -> None:
    """Write a note into a session's log. Earlier entries are not changed; only an incomplete last line, left by a
    crash, is removed."""
    from study.store.sessions.archive import find_session

    write_note(find_session(session, data), text, adverse)


def write_note(folder: "SessionFolder", text: str, adverse: bool) -> None:
    """Write the note, or leave it in the inbox of the running session, and print on stderr which of the two happened.
    adverse: whether it is an adverse event."""
    from study.devices.clock import RealClock
    from study.session.watching.requests import NoteAsked
    from study.workflows.views.take_note import take_note

    is_written = take_note(folder, NoteAsked("experimenter", text, adverse), RealClock())
    waiting_text = f"The session writes it into the log of {folder.name} as soon as it looks."
    typer.echo(f"Noted in {folder.name}." if is_written else waiting_text, err=True)
