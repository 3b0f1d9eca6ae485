"""Requests of the screens outside a sitting. The application receives them and lets the engine do the work.

Values: none is changed after it was posted (Textual writes its own fields into a message, so they cannot be frozen).
"""

from dataclasses import dataclass

from textual.message import Message


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
class SessionWanted(Message):
    """Look at it."""

    path: str


@dataclass(eq=False)
class AnalyzeWanted(Message):
    """Write its tables, figures and report anew."""

    path: str


@dataclass(eq=False)
class WithdrawWanted(Message):
    """Erase the data of this session's participant. The code was typed to confirm it."""

    path: str


@dataclass(eq=False)
class WatchWanted(Message):
    """Follow it while it runs."""

    path: str


@dataclass(eq=False)
class DiagnosisWanted(Message):
    """Show this diagnosis."""

    path: str
    """Path of a diagnosis.json."""


@dataclass(eq=False)
class DiagnoseWanted(Message):
    """Compare recordings with a model."""

    sources: tuple[str, ...]
    """Files, or one session's folder."""
    model: str
    """Empty: none is given."""
    out: str
    """Folder for the results; empty: a new one near what is diagnosed."""
    clean: tuple[str, ...] = ()
    """Recordings of the device when it was in order."""


@dataclass(eq=False)
class CalibrateWanted(Message):
    """Lay the accelerometer on this serial line down in six positions."""

    port: str
    baud: int


@dataclass(eq=False)
class LaidDown(Message):
    """The device lies as the engine asked."""

    number: int


@dataclass(eq=False)
class KeepWanted(Message):
    """Put the table of a calibration into the lab's file."""

    table: str


@dataclass(eq=False)
class CalibrationStopped(Message):
    """End it; nothing is written."""


@dataclass(eq=False)
class HomeWanted(Message):
    """Back to the start screen, with its list read anew."""
