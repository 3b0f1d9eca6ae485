"""Start the screen of `study` and `resume`, and print the results when it ends."""

import os
import shutil
import sys
from typing import TYPE_CHECKING

import typer

from study.errors import DeviceError, ExitCode, StudyError, UserInterruptError, WrongUseError

if TYPE_CHECKING:
    from study.tui.app.app_start import AppStart
    from study.tui.engine.from_engine import Failed, Finished

KINDS: dict[int, type[StudyError]] = {
    ExitCode.WRONG_USE: WrongUseError,
    ExitCode.DEVICE: DeviceError,
    ExitCode.INTERRUPTED: UserInterruptError,
}
"""Error for an exit code that the screen's process ended with; `StudyError` for any other."""


def has_screen() -> bool:
    """Whether there is a terminal, or a browser of `hapteq serve`, to draw on. Results may go to a file."""
    if "TEXTUAL_DRIVER" in os.environ:
        return True
    return has_keys() and sys.stderr is not None and sys.stderr.isatty() and os.environ.get("TERM") != "dumb"


def has_keys() -> bool:
    """Whether standard input may be a keyboard."""
    return sys.stdin is not None and sys.stdin.isatty()


def columns() -> int | None:
    """Width of the terminal for results; None for a file or pipe, whose lines are not wrapped."""
    return shutil.get_terminal_size().columns if sys.stdout is not None and sys.stdout.isatty() else None


def open_screen(start: "AppStart", as_json: bool) -> None:
    """Run the screen. Raises StudyError for an unfinished sitting."""
    from study.tui.app.app import HapteqApp

    app = HapteqApp(start)
    try:
        app.run()
    finally:
        app.close_engine()
    _print_outcome(app.outcome, as_json)
    if app.return_code:
        raise typer.Exit(app.return_code)


def _print_outcome(outcome: "Finished | Failed | None", as_json: bool) -> None:
    from study.tui.engine.from_engine import Failed

    if outcome is None:
        return
    if isinstance(outcome, Failed):
        error = outcome.error
        kind = KINDS.get(error.exit_code, StudyError)
        raise kind(error.title, error.happened, error.do_now, error.saved)
    results = outcome.results
    for line in (results.document,) if as_json else results.table:
        typer.echo(line)
    if not as_json:
        for warning in results.warnings:
            typer.echo(f"Note: {warning}", err=True)
        typer.echo(f"Report: {results.report}", err=True)
