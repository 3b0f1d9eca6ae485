"""Requests of the screens outside a sitting. The application receives them and lets the engine do the work.

Values: none is changed after it was posted (Textual writes its own fields into a message, so they cannot be frozen).
"""

from dataclasses import dataclass

from textual.message import Message

from study.tui.engine.to_engine import Diagnose, ToEngine


@dataclass(eq=False)
class BeginWanted(Message):
    """A new session."""

    subject: str
    protocol: str
    """Name or path."""
    device: str
    model: str = ""
    """File of the model that equalizes; empty where the protocol needs none."""


@dataclass(eq=False)
class ResumeWanted(Message):
    """Resume this session."""

    path: str
    """Path of the session's folder, here and below."""


@dataclass(eq=False)
class WatchWanted(Message):
    """Follow it while it runs."""

    path: str


@dataclass(eq=False)
class DiagnoseWanted(Message):
    """Compare recordings with a model, and show how far that is."""

    command: Diagnose


@dataclass(eq=False)
class CommandWanted(Message):
    """A request that the engine takes as it is."""

    command: ToEngine


@dataclass(eq=False)
class HomeWanted(Message):
    """Back to the start screen, with its list read anew."""
