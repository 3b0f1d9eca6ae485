"""Entry point of the command `hapteq`: runs a subcommand, and maps errors to messages and exit codes.

The subcommands are listed in `command_table`, a file for each. Results are written to stdout, messages and progress to
stderr. Commands import most modules in their bodies, so that `--help` is fast. `main` is called by
`study/launcher/hapteq_launcher.py`.
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

CommandLineError: Any = next(base for base in typer.BadParameter.__mro__ if base.__name__ == "ClickException")
"""Exception class that typer raises for an unknown command or an invalid option: click's ClickException, whose module
differs between versions of typer."""


INTERRUPTED = StudyError(
    "Interrupted",
    "The command was interrupted before it was finished.",
    "Run it again.",
    saved="Files that it had written are complete.",
)
"""Error that is reported after Ctrl-C, unless the command raises a more specific one."""


def _print_version(is_requested: bool) -> None:
    """Print the version and exit, where it is requested. Callback of --version."""
    if is_requested:
        from importlib.metadata import version

        typer.echo(f"hapteq {version('hapteq')}")
        raise typer.Exit


# Without a docstring, which typer would show as help.
@app.callback()
def options(
    version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version and exit.")
    ] = False,
) -> None:
    return None


def main(arguments: list[str] | None = None) -> int:
    """Run a command and return its exit code (`ExitCode`). StudyError, OSError, wrong use and Ctrl-C are reported on
    stderr, except for a broken pipe (BrokenPipeError), which only sets the exit code; any other exception is raised.
    arguments: None = those of the process."""
    _configure_process()
    try:
        exit_code = app(args=arguments, standalone_mode=False)
        if exit_code == ExitCode.INTERRUPTED:  # some versions of typer return exit codes that others raise
            raise KeyboardInterrupt
        return exit_code if isinstance(exit_code, int) else ExitCode.DONE
    except StudyError as error:
        print_error(error)
        return error.exit_code
    except CommandLineError as error:
        error.show()
        return ExitCode.WRONG_USE
    except (KeyboardInterrupt, typer.Abort):
        print_error(INTERRUPTED)
        return ExitCode.INTERRUPTED
    except BrokenPipeError:
        return ExitCode.ERROR
    except OSError as problem:
        print_error(_describe_system_error(problem))
        return ExitCode.ERROR


def _configure_process() -> None:
    """Configure output streams, signal handlers and thread counts of numerical libraries for this process."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")  # a terminal without braille shows question marks, not a traceback
    for signal_name in ("SIGTERM", "SIGHUP"):
        if hasattr(signal, signal_name):
            signal.signal(getattr(signal, signal_name), _interrupt_on_signal)
    for library in ("OPENBLAS", "OMP", "MKL"):
        # For small matrices, threads cost more time than they save. The libraries read this when numpy is imported.
        os.environ.setdefault(f"{library}_NUM_THREADS", "1")


def print_error(error: StudyError) -> None:
    """Print an error on stderr: title, what happened, what is saved, what to do."""
    sentences = [qualify_commands(sentence) for sentence in (error.happened, error.saved, error.do_now)]
    try:
        sys.stderr.write(f"{error.title}\n" + "".join(f"  {sentence}\n" for sentence in sentences if sentence))
        sys.stderr.flush()
    except OSError:  # a closed terminal receives nothing, and Python must not try to flush to it again at exit
        sys.stderr = io.StringIO()


def qualify_commands(text: str) -> str:
    """Replace `hapteq`, where a lower-case word and a space follow it, by the path of the executable, if the shell
    would not find it: after `make study`, hapteq is not on the PATH."""
    executable = Path(sys.argv[0])
    if shutil.which("hapteq") or executable.name != "hapteq":
        return text
    return re.sub(r"\bhapteq (?=[a-z]+ )", f"{executable} ", text)


def _describe_system_error(problem: OSError) -> StudyError:
    """Describe an operating-system error that no command reports itself, such as missing permissions or a full disk."""
    file_note = f" ({problem.filename})" if problem.filename else ""
    return StudyError(
        "The system refused",
        f"{problem.strerror or problem}{file_note}.",
        "Check the permissions and the room on the disk, then run the command again.",
        saved="Everything reported as written so far is on disk.",
    )


def _interrupt_on_signal(signal_number: int, frame: FrameType | None) -> None:
    """Handle SIGTERM and SIGHUP (closed terminal) like Ctrl-C, so that the device is released and the log closed."""
    raise KeyboardInterrupt
