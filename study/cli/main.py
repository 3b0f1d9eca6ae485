"""The command `hapteq`: one file per subcommand, and the only place that turns errors into words and exit codes.

Results go to stdout, talk and progress to stderr. Imports are light, so that `--help` is instant: a command's body
imports what it needs.
"""

import io
import os
import re
import shutil
import signal
import sys
from pathlib import Path
from types import FrameType
from typing import Annotated, Any

import typer

from study.cli.command_table import CommandTable
from study.errors import ExitCode, StudyError

app = typer.Typer(
    name="hapteq",
    cls=CommandTable,
    help="Force-direction studies on haptic devices: run them, and know what the device really played.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"]},
)

WrongCommandLine: Any = next(kind for kind in typer.BadParameter.__mro__ if kind.__name__ == "ClickException")
"""What typer raises for an unknown command or a bad option; its module differs between versions of typer."""


INTERRUPTED = StudyError(
    "Interrupted",
    "The command was interrupted before it was finished.",
    "Run it again.",
    saved="Files that it had written are complete.",
)
"""Said after Ctrl-C where a command says nothing better."""


def _version(is_requested: bool) -> None:
    if is_requested:
        from importlib.metadata import version

        typer.echo(f"hapteq {version('hapteq')}")
        raise typer.Exit


@app.callback()
def options(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version and exit.")
    ] = False,
) -> None:
    return None


def main(arguments: list[str] | None = None) -> int:
    """Run one command; returns its exit code."""
    _settle_in()
    try:
        code = app(args=arguments, standalone_mode=False)
        if code == ExitCode.INTERRUPTED:  # some versions of typer return exit codes that others raise
            raise KeyboardInterrupt
        return code if isinstance(code, int) else ExitCode.DONE
    except StudyError as error:
        print_error(error)
        return error.exit_code
    except WrongCommandLine as error:
        error.show()
        return ExitCode.WRONG_USE
    except (KeyboardInterrupt, typer.Abort):
        print_error(INTERRUPTED)
        return ExitCode.INTERRUPTED
    except BrokenPipeError:
        return ExitCode.ERROR
    except OSError as problem:
        print_error(_system_error(problem))
        return ExitCode.ERROR


def _settle_in() -> None:
    """Configure streams, signals and libraries of this process."""
    for output in (sys.stdout, sys.stderr):
        if isinstance(output, io.TextIOWrapper):
            output.reconfigure(errors="replace")  # a terminal without braille shows question marks, not a traceback
    for name in ("SIGTERM", "SIGHUP"):
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), _exit_on_signal)
    for library in ("OPENBLAS", "OMP", "MKL"):
        # Matrices here are small: threads would cost more in waiting than they save. Read when numpy is loaded.
        os.environ.setdefault(f"{library}_NUM_THREADS", "1")


def print_error(error: StudyError) -> None:
    """Print an error on stderr: title, what happened, what is saved, what to do."""
    parts = [spell_commands(part) for part in (error.happened, error.saved, error.do_now)]
    try:
        sys.stderr.write(f"{error.title}\n" + "".join(f"  {part}\n" for part in parts if part))
        sys.stderr.flush()
    except OSError:  # a closed terminal receives nothing, and Python must not try to flush to it again at exit
        sys.stderr = io.StringIO()


def spell_commands(sentence: str) -> str:
    """Command names as they can be typed here: after `make study`, hapteq is not on the path."""
    started_as = Path(sys.argv[0])
    if shutil.which("hapteq") or started_as.name != "hapteq":
        return sentence
    return re.sub(r"\bhapteq (?=[a-z]+ )", f"{started_as} ", sentence)


def _system_error(problem: OSError) -> StudyError:
    """The error for operating-system errors without a named one: missing rights, a full disk, a closed terminal."""
    file_note = f" ({problem.filename})" if problem.filename else ""
    return StudyError(
        "The system refused",
        f"{problem.strerror or problem}{file_note}.",
        "Check the permissions and the room on the disk, then run the command again.",
        saved="Everything reported as written so far is on disk.",
    )


def _exit_on_signal(number: int, frame: FrameType | None) -> None:
    """SIGTERM or a closed terminal: leave like Ctrl-C, with the device released and the log closed."""
    raise KeyboardInterrupt
