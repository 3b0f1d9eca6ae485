"""Textual messages that screens outside a sitting post: requests of the user to the application.

`study.tui.app.app.HapteqApp` handles them (`on_begin_requested`, ...). They cannot be frozen dataclasses, because
Textual sets attributes of a message.
"""

from dataclasses import dataclass

from textual.message import Message

from study.tui.engine.to_engine import Diagnose, ToEngine


@dataclass(eq=False)
class BeginRequested(Message):
    """Begin a new session."""

    subject: str
    """Participant code."""
    protocol: str
    """Name of a shipped protocol, or path of a protocol file."""
    device: str
    model: str = ""
    """File of the identified model that equalizes the stimuli; empty if the protocol needs none."""


@dataclass(eq=False)
class ResumeRequested(Message):
    """Resume a session."""

    path: str
    """Path of the session's folder."""


@dataclass(eq=False)
class WatchRequested(Message):
    """Show the experimenter's view of a running session."""

    path: str
    """Path of the session's folder."""


@dataclass(eq=False)
class DiagnoseRequested(Message):
    """Diagnose recordings against a model, and show the progress."""

    command: Diagnose


@dataclass(eq=False)
class CommandRequested(Message):
    """Send a command to the engine unchanged, for a request without a message class of its own."""

    command: ToEngine


@dataclass(eq=False)
class HomeRequested(Message):
    """Return to the start screen, whose list of sessions is read again."""
