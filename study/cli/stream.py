"""`hapteq stream`: a running session's facts as markers for the lab streaming layer."""

from pathlib import Path
from typing import Annotated

import typer

from study.cli.study import DataOption


def stream(
    session: Annotated[str, typer.Argument(help="Session folder, or its name in the data folder.")],
    data: DataOption = Path("data"),
) -> None:
    """Follow a running session from a second terminal and send each of its facts as an LSL marker, until it is
    finished or Ctrl-C. Needs pip install '.[lsl]'."""
    from study.store.sessions.archive import find_session
    from study.workflows.views.stream_session import MarkerOutlet, stream_session

    folder = find_session(session, data)
    outlet = MarkerOutlet(folder.log)
    typer.echo(f"Streaming markers of {folder.name}; Ctrl-C ends it, and not the session.", err=True)
    sent = stream_session(folder.log, outlet, on_marker=typer.echo)
    typer.echo(f"{sent} markers; the session is finished.", err=True)
