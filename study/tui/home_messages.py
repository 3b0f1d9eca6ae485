"""Textual messages that screens outside a sitting post: requests of the user to the application.

The application receives them and sends commands to the engine. They are not changed after they are posted, but
cannot be frozen, because Textual stores fields of its own in a message.
"""

from dataclasses import dataclass

from textual.message import Message

from study.tui.engine.to_engine import Diagnose, ToEngine


@dataclass(eq=False)
class BeginWanted(Message):
    """Begin a new session."""

    subject: str
    """Participant code."""
    protocol: str
    """Name of a shipped protocol, or path of a protocol file."""
    device: str
    """Name of the device."""
    model: str = ""
    """File of the identified model that equalizes the stimuli; empty if the protocol needs none."""


@dataclass(eq=False)
class ResumeWanted(Message):
    """Resume a session."""

    path: str
    """Path of the session's folder."""


@dataclass(eq=False)
class WatchWanted(Message):
    """Show the experimenter's view of a running session."""

    path: str
    """Path of the session's folder."""


@dataclass(eq=False)
class DiagnoseWanted(Message):
    """Diagnose recordings against a model, and show the progress."""

    command: Diagnose


@dataclass(eq=False)
class CommandWanted(Message):
    """Any other request: a message that is passed to the engine unchanged."""

    command: ToEngine


@dataclass(eq=False)
class HomeWanted(Message):
    """Return to the start screen, and read the list of sessions again."""
