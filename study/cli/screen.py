"""Starts the full-screen interface of `hapteq study` and `hapteq resume`, and prints the results when it ends.

`has_screen`, `has_keyboard` and `read_terminal_width` examine the terminal, some also for other commands, and
`print_file_text` prints the content of a file.
"""

import io
import os
import shutil
import sys
from typing import TYPE_CHECKING

import typer

if TYPE_CHECKING:
    from study.tui.app.start_options import StartOptions
    from study.tui.engine.from_engine import Failed, Finished


def has_screen() -> bool:
    """Whether the interface can be drawn: in a browser (`hapteq serve` sets TEXTUAL_DRIVER), or in a terminal that is
    connected to standard input and stderr and not dumb. Standard output may be a file."""
    if "TEXTUAL_DRIVER" in os.environ:
        return True
    return has_keyboard() and sys.stderr is not None and sys.stderr.isatty() and os.environ.get("TERM") != "dumb"


def has_keyboard() -> bool:
    """Whether standard input is a terminal, so that a person may press keys."""
    return sys.stdin is not None and sys.stdin.isatty()


def read_terminal_width() -> int | None:
    """Read the width of the terminal on stdout, in columns; None for a file or pipe, whose lines are not wrapped."""
    return shutil.get_terminal_size().columns if sys.stdout is not None and sys.stdout.isatty() else None


def print_file_text(text: str) -> None:
    """Print the content of a text file on stdout: in UTF-8 where that is a file or pipe, whose own encoding could not
    hold each character, and hapteq reads UTF-8. What cannot be encoded, such as bytes of a file name, becomes "?"."""
    is_file = isinstance(sys.stdout, io.TextIOWrapper) and not sys.stdout.isatty()
    typer.echo(text.encode(errors="replace") if is_file else text, nl=False)


def open_screen(options: "StartOptions", as_json: bool) -> None:
    """Run the interface until it is closed, then print the results. Raises the StudyError of a failed sitting, and
    typer.Exit for an exit code other than 0."""
    from study.tui.app.app import HapteqApp

    app = HapteqApp(options)
    try:
        app.run()
    finally:
        app.close_engine()
    _print_outcome(app.outcome, as_json)
    if app.return_code:
        raise typer.Exit(app.return_code)


def _print_outcome(outcome: "Finished | Failed | None", as_json: bool) -> None:
    """Print the results of a finished sitting; nothing without an outcome. Raises the StudyError of a failed one."""
    from study.tui.engine.from_engine import Failed

    if outcome is None:
        return
    if isinstance(outcome, Failed):
        raise outcome.error
    results = outcome.results
    if as_json:
        typer.echo(results.document)
        return
    from study.cli.results import print_table

    print_table(results.table, results.warnings, results.report)
