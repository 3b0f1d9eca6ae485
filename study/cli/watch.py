"""Command `hapteq watch`: the experimenter's view of a running session, and requests to it (stop, pause, notes).

The view is a full screen, lines, or the present state once.
"""

import json
import shlex
import sys
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from study.cli.screen import read_terminal_width
from study.cli.session_options import DataOption

if TYPE_CHECKING:
    from study.session.watching.requests import Request
    from study.store.sessions.archive import SessionFolder

LOG_NAME = "events.jsonl"
"""Same as `study.store.sessions.event_log.LOG_NAME`, whose import would delay the first frame."""
PLAIN_UPDATE_INTERVAL_S = 0.2
"""Interval (s) between two updates of the output as plain lines. Chosen."""


def watch(
    session: Annotated[
        str,
        typer.Argument(
            help="Session folder, or its name in the data folder. Default: the one that changed last; to pause "
            "or note: the one that runs; to stop: all that run."
        ),
    ] = "",
    data: DataOption = Path("data"),
    plain: Annotated[bool, typer.Option("--plain", help="A line for each event; alarms ring.")] = False,
    once: Annotated[bool, typer.Option("--once", help="Print the present state and exit.")] = False,
    stop: Annotated[bool, typer.Option("--stop", help="Force off at once; the sitting ends.")] = False,
    pause: Annotated[
        bool, typer.Option("--pause", help="Hands free at once; the participant continues the session.")
    ] = False,
    note: Annotated[str, typer.Option(metavar="TEXT", help="A note for the log.")] = "",
    adverse: Annotated[str, typer.Option(metavar="TEXT", help="An adverse event for the log.")] = "",
    as_json: Annotated[bool, typer.Option("--json", help="With --once: one JSON document on stdout.")] = False,
) -> None:
    """Follow a running session from a second terminal, without changing it; stop it, pause it, note something."""
    is_request = bool(stop or pause or note or adverse)
    if is_request:
        folders = _find_requested(session, data) if session else _find_running(data)
        _send_requests(folders, stop, pause, ((note, False), (adverse, True)))
        return
    folder = _find_folder(session, data) if session else _find_last_changed(data)
    if once or as_json:
        _print_state(folder, as_json)
    elif plain or not (sys.stdin is not None and sys.stdin.isatty() and sys.stdout.isatty()):
        _follow_in_lines(folder)
    else:
        _show_screen(folder)


def _find_folder(session: str, data: Path) -> Path:
    """Find the session's folder by its path, or by its name in `data`. Raises StudyError where there is no session, or
    a withdrawn one."""
    for path in (Path(session), data / session):
        if (path / LOG_NAME).is_file():
            return path.resolve()
    from study.store.sessions.archive import find_session

    return find_session(session, data).path


def _find_requested(session: str, data: Path) -> tuple[Path, ...]:
    """Find the folders of a session to which a request is sent. Where both a path and a session in `data` have this
    name, those that may be running: a stop must reach the handle that moves. Raises as `_find_folder`, and
    WrongUseError where neither of both runs."""
    from study.store.sessions.archive import require_single_folder
    from study.store.sessions.log_lock import is_log_locked

    logs = [path / LOG_NAME for path in (Path(session), data / session)]
    running = [log.parent.resolve() for log in logs if log.is_file() and is_log_locked(log) is not False]
    if not running:
        require_single_folder(session, data)
    return tuple(dict.fromkeys(running)) or (_find_folder(session, data),)


def _find_last_changed(data: Path) -> Path:
    """Find the folder of the session in `data` whose log changed last. Raises WrongUseError without a session."""
    logs = sorted(data.glob(f"*/{LOG_NAME}"), key=lambda log: log.stat().st_mtime)
    if not logs:
        from study.errors import WrongUseError

        raise WrongUseError(
            "There is no session to watch", f"No folder in {data} holds a session.", "Give a session, or --data."
        )
    return logs[-1].parent.resolve()


def _find_running(data: Path) -> tuple[Path, ...]:
    """Find the folders of the sessions in `data` that run; where none is known to run, that of the session that changed
    last. Raises WrongUseError where there is none."""
    from study.store.sessions.log_lock import is_log_locked

    running = tuple(log.parent.resolve() for log in sorted(data.glob(f"*/{LOG_NAME}")) if is_log_locked(log))
    return running or (_find_last_changed(data),)


def _require_single(folders: tuple[Path, ...]) -> Path:
    """Return the only folder. Raises WrongUseError where there are several."""
    if len(folders) > 1:
        from analysis.wording import conjoin
        from study.errors import WrongUseError

        raise WrongUseError(
            "Several sessions are running",
            f"A pause or a note is for one of them, and {conjoin([folder.name for folder in folders])} are running.",
            f"Repeat it with the session's folder, such as {shlex.quote(str(folders[0]))}. To end all of them: --stop.",
            saved="No pause and no note was sent.",
        )
    return folders[0]


def _show_screen(folder: Path) -> None:
    """Show the full-screen view until it is closed; the log is read in a separate process."""
    from study.store.sessions.request_inbox import RequestInbox
    from study.tui.engine.watch_feed import WatchFeed
    from study.tui.watch.watch_app import WatchApp

    feed = WatchFeed(str(folder))
    try:
        # A stop is written directly to the session's folder: it must not depend on the reading process.
        WatchApp(feed, RequestInbox(folder).send).run()
    finally:
        feed.close()


def _print_state(folder: Path, as_json: bool) -> None:
    """Print the present state of the session, as lines or as one JSON document. Raises StudyError where the log is
    empty."""
    from dataclasses import asdict

    from study.devices.clock import RealClock
    from study.errors import StudyError
    from study.tui.text_rows import wrap_hanging
    from study.tui.watch.watch_lines import LABEL_CELLS, format_changes
    from study.workflows.views.watch_session import follow

    view = follow(folder).look(RealClock().utc())
    if view is None:
        raise StudyError("This session has not begun", f"{folder.name} has no line yet.", "Look again in a moment.")
    if as_json:
        typer.echo(json.dumps(asdict(view), indent=2))
        return
    for line in format_changes(None, view):
        for terminal_line in wrap_hanging(line, LABEL_CELLS, read_terminal_width()):
            typer.echo(terminal_line)


def _follow_in_lines(folder: Path) -> None:
    """Print each change of the session as a line, until its program no longer runs."""
    from study.devices.clock import RealClock
    from study.session.watching.watch_view import RUNNING_STATUSES
    from study.tui.watch.watch_lines import format_changes
    from study.workflows.views.watch_session import follow

    clock, follower, previous_view = RealClock(), follow(folder), None
    while previous_view is None or previous_view.standing in RUNNING_STATUSES:
        view = follower.look(clock.utc())
        if view is not None:
            for line in format_changes(previous_view, view):
                typer.echo(line)
            previous_view = view
        clock.sleep(PLAIN_UPDATE_INTERVAL_S)


def _send_requests(folders: tuple[Path, ...], stop: bool, pause: bool, notes: tuple[tuple[str, bool], ...]) -> None:
    """Send the requests in the order stop, notes, pause: the stop to all sessions, because a handle must not go on
    moving where the name was left out; the others to a single session. notes: text (an empty one is not sent), and
    whether it is an adverse event. Raises WrongUseError for notes or a pause to several sessions."""
    from study.cli.note import write_note
    from study.session.watching.requests import PauseAsked
    from study.store.sessions.archive import SessionFolder

    if stop:
        _stop_all(tuple(SessionFolder(folder) for folder in folders))
    if not (pause or any(text for text, _ in notes)):
        return
    session = SessionFolder(_require_single(folders))
    for text, adverse in notes:
        if text:
            write_note(session, text, adverse)
    if pause:
        _send_request(session, PauseAsked("experimenter"), "Paused. The participant continues at their own screen.")


def _stop_all(sessions: tuple["SessionFolder", ...]) -> None:
    """Stop the sessions at the same time, each also where another does not respond. Raises the last StudyError."""
    from concurrent.futures import ThreadPoolExecutor

    from study.errors import StudyError
    from study.session.watching.requests import StopAsked

    def stop(session: "SessionFolder") -> StudyError | None:
        """Stop one session; returns the error where that fails."""
        try:
            _send_request(session, StopAsked("experimenter"), f"{session.name}: the force is off, the sitting ends.")
        except StudyError as error:
            return error
        typer.echo(f"Continue with: {_format_resume_command(session)}", err=True)
        return None

    with ThreadPoolExecutor(len(sessions)) as pool:
        errors = [error for error in pool.map(stop, sessions) if error is not None]
    if errors:
        raise errors[-1]


def _send_request(session: "SessionFolder", request: "Request", confirmation: str) -> None:
    """Send a request to the session, then print the confirmation on stderr."""
    from study.devices.clock import RealClock
    from study.workflows.views.send_request import send_request

    send_request(session, request, RealClock())
    typer.echo(confirmation, err=True)


def _format_resume_command(session: "SessionFolder") -> str:
    """Format the command that continues the session on its device; without a device where the log cannot be read,
    because a stop must not depend on that."""
    from study.errors import StudyError
    from study.session.facts.events import SessionOpened
    from study.session.views.resume_command import (
        SIMULATED_DEVICE,
        format_logged_resume_command,
        format_resume_command,
    )
    from study.store.sessions import event_log

    with suppress(StudyError, OSError):
        session_opened = event_log.read_opening(session.log)
        if isinstance(session_opened, SessionOpened):
            device = session_opened.device
            return format_logged_resume_command(str(session.path), device.name, device.simulated)
    return format_resume_command(str(session.path), SIMULATED_DEVICE)
