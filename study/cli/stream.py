"""Command `hapteq stream`: send a running session's events, forces and motion to the lab streaming layer (LSL).

Options and output only; `study.workflows.views.stream_session` follows the log.
"""

import contextlib
import time
from pathlib import Path
from typing import Annotated

import typer

from study.cli.session_options import DataOption


def stream(
    session: Annotated[str, typer.Argument(help="Session folder, or its name in the data folder.")],
    data: DataOption = Path("data"),
) -> None:
    """Follow a running session from a second terminal and send each of its events as an LSL marker, and force,
    acceleration and motion of each control tick in further streams, until the session is finished or Ctrl-C is pressed.
    Needs pip install '.[lsl]'."""
    from study.errors import StudyError
    from study.session.watching.requests import NoteAsked
    from study.store.sessions.archive import find_session
    from study.store.sessions.request_inbox import RequestInbox
    from study.workflows.views.lsl_outlets import MarkerOutlet
    from study.workflows.views.stream_session import SideTasks, stream_session
    from study.workflows.views.stream_signals import SignalStreams

    folder = find_session(session, data)
    outlet, inbox = MarkerOutlet(folder.log), RequestInbox(folder.path)
    signals = SignalStreams(folder.path, outlet.make_signal_outlet)

    def log_clock_offset(offset_s: float) -> None:
        """Send the offset of LSL's clock (s) to the session as a note; without an effect where it cannot be sent."""
        offset_note = (
            f"LSL's clock was {offset_s:.6f} s ahead of the session's when that said {time.monotonic():.3f} s."
        )
        with contextlib.suppress(StudyError):  # the marker "clock" states the offset, too
            inbox.send(NoteAsked("program", offset_note))

    typer.echo(f"Streaming {folder.name}; Ctrl-C ends it, and not the session.", err=True)
    marker_count = stream_session(
        folder.log, outlet, on_marker=typer.echo, side_tasks=SideTasks(log_clock_offset, signals.push)
    )
    typer.echo(f"{marker_count} markers and {signals.sent_ticks} ticks; the session is finished.", err=True)
