"""Table of the commands of `hapteq` in groups, each imported only when it is looked up (lazy loading).

A command's module and the function in it have the name of the command, with "_" for "-" (exceptions:
`KEYWORD_MODULES`); a command with subcommands is a typer application `app`. `main` uses `CommandTable`, the commands
with subcommands (`kit`, `protocol`) `Subcommands`.
"""

from collections.abc import Iterator, Mapping
from importlib import import_module
from typing import Any

import typer
from typer.core import TyperGroup
from typer.main import get_command

KEYWORD_MODULES = {"import": "import_recording"}
"""Name of module and function, by command, of the commands whose names are keywords of Python."""

COMMANDS: dict[str, dict[str, str]] = {
    "Study": {
        "study": "Take the study: instructions, training, staircases, report",
        "resume": "Continue a session where it stopped; no answer is lost",
        "watch": "Follow, pause or stop a running session from a second terminal",
        "stream": "Send a running session's facts as LSL markers",
        "note": "Write a note into a session's log",
        "sessions": "List all sessions, latest first: how far each one is",
        "study-plan": "Show who is done, which orders are needed, the next code",
        "withdraw": "Erase a participant's sessions; a tombstone stays",
        "serve": "Show the study in a browser of this computer",
        "noise": "Write pink noise that hides the sound of the device",
        "protocol": "List, show and lock protocols",
    },
    "Analysis": {
        "analyze": "Write thresholds.csv, anova.json, figures and report.html",
        "show": "Print the facts of a session, a diagnosis or a recording",
        "validate": "Check files: recordings, models, protocols, tables, logs",
        "rehearse": "Let simulated participants take the whole study",
        "export": "Write trials as Psych-DS, BIDS, MATLAB or CSV files",
        "power": "Find the number of participants needed, by simulation",
        "effect": "Save a discovered law as an effect for later diagnoses",
    },
    "Device": {
        "doctor": "Check installation, device, sensor and 1 kHz timing",
        "calibrate": "Read inertia and Jacobian over the workspace, at rest",
        "record": "Record the device's answer to an excitation",
        "identify": "Fit a stable state-space model to a band, and test it",
        "equalize": "Compute the forces that give wanted accelerations",
        "contact": "Play a contact transient along the surface's normal",
        "export-controller": "Write a model's controller as C11 code, for your own loops",
        "twin": "Write the mechanical model of a device, from its answers",
    },
    "Diagnosis": {
        "import": "Write one recording from files of others, units in SI",
        "look": "Show signals, spectra, coherence and checks, before any model",
        "model": "Fit a first model: masses, dampers, springs, tolerances",
        "diagnose": "Name the physics that a model lacks, tested on held-out data",
    },
    "Evaluation": {
        "prove": "Diagnose concealed physics in simulated devices, and count",
        "real": "Diagnose a folder of real recordings, on one page",
        "reproduce": "Draw the paper's figures next to the values it reports",
        "kit": "Take a blind test on your own device",
    },
}
"""Short help of each command, by the title of its group."""


class LazyCommands(Mapping[str, Any]):
    """Mapping from a command's name to the command, which is imported only when it is looked up: `--help` and
    `--version` import none. Raises KeyError for an unknown name."""

    def __init__(self) -> None:
        self.short_helps = {name: short_help for group in COMMANDS.values() for name, short_help in group.items()}

    def __getitem__(self, name: str) -> Any:
        short_help = self.short_helps[name]
        module_name = KEYWORD_MODULES.get(name, name.replace("-", "_"))
        module = import_module(f"study.cli.{module_name}")
        app = getattr(module, "app", None)
        if app is None:
            app = typer.Typer(add_completion=False, rich_markup_mode=None)
            context_settings = getattr(module, "CONTEXT_SETTINGS", None)
            app.command(name, short_help=short_help, context_settings=context_settings)(getattr(module, module_name))
        return get_command(app)

    def __iter__(self) -> Iterator[str]:
        return iter(self.short_helps)

    def __len__(self) -> int:
        return len(self.short_helps)


class CommandTable(TyperGroup):
    """The command `hapteq`: all commands of `COMMANDS`, listed by group in `--help` with their complete short help."""

    @property
    def commands(self) -> Any:
        """Commands by name, each imported when it is looked up."""
        return LazyCommands()

    @commands.setter
    def commands(self, registered: Any) -> None:
        """Do nothing: typer assigns the commands registered with it, and there are none."""

    def list_commands(self, ctx: Any) -> list[str]:
        """Names in the order of `COMMANDS`."""
        return list(self.commands)

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write the commands under the titles of their groups, without importing any."""
        for title, short_helps in COMMANDS.items():
            with formatter.section(title):
                formatter.write_dl(list(short_helps.items()))


class Subcommands(TyperGroup):
    """A command with subcommands, which lists them in `--help` with their complete short help."""

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write the subcommands under one title, each with up to 200 characters of its help."""
        with formatter.section("Commands"):
            formatter.write_dl(
                [(name, command.get_short_help_str(limit=200)) for name, command in self.commands.items()]
            )
