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

from study.cli import (
    analyze,
    contact,
    diagnose,
    doctor,
    effect,
    equalize,
    export,
    export_controller,
    identify,
    import_recording,
    kit,
    look,
    model,
    noise,
    note,
    power,
    protocol,
    prove,
    real,
    record,
    rehearse,
    reproduce,
    resume,
    serve,
    sessions,
    show,
    stream,
    study,
    study_plan,
    twin,
    validate,
    watch,
    withdraw,
)
from study.cli.command_groups import CommandGroups
from study.errors import ExitCode, StudyError

app = typer.Typer(
    name="hapteq",
    cls=CommandGroups,
    help="Force-direction studies on haptic devices: run them, and know what the device really played.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"]},
)
app.command("study", short_help="Take the study: instructions, training, staircases, report", rich_help_panel="Study")(
    study.study
)
app.command("resume", short_help="Go on with a session where it stopped; no answer is lost", rich_help_panel="Study")(
    resume.resume
)
app.command(
    "watch", short_help="Follow, pause or stop a running session from a second terminal", rich_help_panel="Study"
)(watch.watch)
app.command("stream", short_help="Send a running session's facts as LSL markers", rich_help_panel="Study")(
    stream.stream
)
app.command("note", short_help="Write a note into a session's log", rich_help_panel="Study")(note.note)
app.command("sessions", short_help="List all sessions, latest first: how far each one is", rich_help_panel="Study")(
    sessions.sessions
)
app.command("study-plan", short_help="Who is done, which orders are needed, the next code", rich_help_panel="Study")(
    study_plan.study_plan
)
app.command("withdraw", short_help="Erase a participant's sessions; a tombstone stays", rich_help_panel="Study")(
    withdraw.withdraw
)
app.command(
    "serve",
    short_help="Show the study in a browser of this computer",
    rich_help_panel="Study",
    context_settings=serve.PASSES_OPTIONS_ON,
)(serve.serve)
app.command("noise", short_help="Write pink noise that hides the sound of the device", rich_help_panel="Study")(
    noise.noise
)
app.add_typer(protocol.app, name="protocol", short_help="List, show and lock protocols", rich_help_panel="Study")
app.command(
    "analyze", short_help="Write thresholds.csv, anova.json, figures and report.html", rich_help_panel="Analysis"
)(analyze.analyze)
app.command("show", short_help="Print the facts of a session, a diagnosis or a recording", rich_help_panel="Analysis")(
    show.show
)
app.command(
    "validate", short_help="Check files: recordings, models, protocols, tables, logs", rich_help_panel="Analysis"
)(validate.validate)
app.command("rehearse", short_help="Simulated participants take the whole study", rich_help_panel="Analysis")(
    rehearse.rehearse
)
app.command("export", short_help="Trials as Psych-DS, BIDS or MATLAB files", rich_help_panel="Analysis")(export.export)
app.command("power", short_help="How many participants are needed, by simulated studies", rich_help_panel="Analysis")(
    power.power
)
app.command("doctor", short_help="Check installation, device, sensor and 1 kHz timing", rich_help_panel="Device")(
    doctor.doctor
)
app.command("record", short_help="Record the device's answer to an excitation", rich_help_panel="Device")(record.record)
app.command("identify", short_help="Fit a stable state-space model to a band, and test it", rich_help_panel="Device")(
    identify.identify
)
app.command("equalize", short_help="Turn wanted accelerations into forces", rich_help_panel="Device")(equalize.equalize)
app.command("contact", short_help="A transient at a contact, turned to its normal, played", rich_help_panel="Device")(
    contact.contact
)
app.command(
    "export-controller", short_help="A model's controller as C11, for loops of your own", rich_help_panel="Device"
)(export_controller.export_controller)
app.command(
    "effect",
    short_help="Keep a discovered law as an effect of your own",
    rich_help_panel="Analysis",
)(effect.effect)
app.command("twin", short_help="Write the mechanical model of the simulated omega.3", rich_help_panel="Device")(
    twin.twin
)
app.command("import", short_help="Write one recording from files of others, units in SI", rich_help_panel="Diagnosis")(
    import_recording.import_recording
)
app.command("look", short_help="Signals, spectra, coherence and checks, before any model", rich_help_panel="Diagnosis")(
    look.look
)
app.command("model", short_help="Fit a first model: masses, dampers, springs, tolerances", rich_help_panel="Diagnosis")(
    model.model
)
app.command(
    "diagnose", short_help="Name the physics that a model lacks, tested on held-out data", rich_help_panel="Diagnosis"
)(diagnose.diagnose)
app.command(
    "prove", short_help="Diagnose concealed physics in simulated devices, and count", rich_help_panel="Evaluation"
)(prove.prove)
app.command("real", short_help="Diagnose a folder of real recordings, on one page", rich_help_panel="Evaluation")(
    real.real
)
app.add_typer(kit.app, name="kit", short_help="Take a blind test on your own device", rich_help_panel="Evaluation")
app.command(
    "reproduce", short_help="Draw the paper's figures beside what the paper reports", rich_help_panel="Evaluation"
)(reproduce.reproduce)


WrongCommandLine: Any = next(kind for kind in typer.BadParameter.__mro__ if kind.__name__ == "ClickException")
"""What typer raises for an unknown command or a bad option; its module differs between versions of typer."""


INTERRUPTED = StudyError(
    "Interrupted",
    "The command was left before it was done.",
    "Run it again.",
    saved="Files that it had written are whole; none is half written.",
)


def _version(wanted: bool) -> None:
    if wanted:
        from importlib.metadata import version

        typer.echo(f"hapteq {version('hapteq')}")
        raise typer.Exit


@app.callback()
def options(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Say the version and exit.")
    ] = False,
) -> None:
    return None


def main(arguments: list[str] | None = None) -> int:
    """Run one command; returns its exit code."""
    _settle_in()
    try:
        code = app(args=arguments, standalone_mode=False)
        if code == ExitCode.INTERRUPTED:  # some versions of typer return what others raise
            raise KeyboardInterrupt
        return code if isinstance(code, int) else ExitCode.DONE
    except StudyError as error:
        say(error)
        return error.exit_code
    except WrongCommandLine as error:
        error.show()
        return ExitCode.WRONG_USE
    except (KeyboardInterrupt, typer.Abort):
        say(INTERRUPTED)
        return ExitCode.INTERRUPTED
    except BrokenPipeError:
        return ExitCode.ERROR
    except OSError as problem:
        say(_system_error(problem))
        return ExitCode.ERROR


def _settle_in() -> None:
    """Configure streams, signals and libraries of this process."""
    for output in (sys.stdout, sys.stderr):
        if isinstance(output, io.TextIOWrapper):
            output.reconfigure(errors="replace")  # a terminal without braille shows question marks, not a traceback
    for name in ("SIGTERM", "SIGHUP"):
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), _leave)
    for library in ("OPENBLAS", "OMP", "MKL"):
        # Our matrices are small: threads would wait for each other longer than they work. Heard before numpy loads.
        os.environ.setdefault(f"{library}_NUM_THREADS", "1")


def say(error: StudyError) -> None:
    """Print an error on stderr: title, what happened, what is saved, what to do."""
    parts = [as_typed(part) for part in (error.happened, error.saved, error.do_now)]
    try:
        sys.stderr.write(f"{error.title}\n" + "".join(f"  {part}\n" for part in parts if part))
        sys.stderr.flush()
    except OSError:  # a terminal that is gone hears nothing, and must not be told once more when Python ends
        sys.stderr = io.StringIO()


def as_typed(sentence: str) -> str:
    """Commands in a sentence as they can be typed here: `make study` puts hapteq nowhere on the path."""
    started_as = Path(sys.argv[0])
    if shutil.which("hapteq") or started_as.name != "hapteq":
        return sentence
    return re.sub(r"\bhapteq (?=[a-z]+ )", f"{started_as} ", sentence)


def _system_error(problem: OSError) -> StudyError:
    """The error for operating-system errors without a named one: missing rights, a full disk, a closed terminal."""
    where = f" ({problem.filename})" if problem.filename else ""
    return StudyError(
        "The system refused",
        f"{problem.strerror or problem}{where}.",
        "Check the permissions and the room on the disk, then run the command again.",
        saved="What was reported as written before is on disk.",
    )


def _leave(number: int, frame: FrameType | None) -> None:
    """SIGTERM or a closed terminal: leave like Ctrl-C, with the device released and the log closed."""
    raise KeyboardInterrupt
