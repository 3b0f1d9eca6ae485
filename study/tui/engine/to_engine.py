"""Messages from the screen to the engine. Values only, pickled over a pipe, light to import."""

from dataclasses import dataclass
from typing import Any

from study.session.watching.requests import Request


@dataclass(frozen=True, slots=True)
class SessionOrder:
    """A new session, as it is asked for."""

    protocol: str
    """A shipped protocol's name, or a file."""
    device: str
    subject: str
    data: str
    seed: int | None = None
    """None: drawn, and logged."""
    model: str = ""
    """File of the identified model that equalizes the stimuli; empty where forces are commanded."""


@dataclass(frozen=True, slots=True)
class ShowHome:
    """Read the data folder for the start screen."""

    data: str
    protocol: str = ""
    """What is offered first; so are device and model."""
    device: str = ""
    model: str = ""


@dataclass(frozen=True, slots=True)
class ShowSession:
    """Read a past session."""

    path: str


@dataclass(frozen=True, slots=True)
class ShowDiagnosis:
    """Read a diagnosis."""

    path: str


@dataclass(frozen=True, slots=True)
class Begin:
    """Begin a session."""

    order: SessionOrder


@dataclass(frozen=True, slots=True)
class Resume:
    """Resume a session after a crash or a pause."""

    session: str
    """Folder, or its name in the data folder."""
    device: str
    data: str


@dataclass(frozen=True, slots=True)
class Analyze:
    """Write the tables and the report of one session, and show it."""

    session: str


@dataclass(frozen=True, slots=True)
class Withdraw:
    """Erase all sessions of this session's participant. The sender has asked twice."""

    session: str


@dataclass(frozen=True, slots=True)
class Diagnose:
    """Compare recordings with a model, write the results and show them. `LetGo` stops it."""

    sources: tuple[str, ...]
    """Files, or one session's folder."""
    model: str
    """Empty: none is given."""
    out: str
    """Empty: a new folder near what is diagnosed."""
    clean: tuple[str, ...] = ()
    """Recordings of the device when it was in order."""


@dataclass(frozen=True, slots=True)
class CalibrateSensor:
    """Six positions of the accelerometer: the engine asks for each by `LayDown`. `LetGo` stops it."""

    port: str
    baud: int


@dataclass(frozen=True, slots=True)
class KeepSensor:
    """Put the table of a calibration into the lab's file."""

    table: str


@dataclass(frozen=True, slots=True)
class AskOtherSession:
    """Ask a session that runs in another program."""

    session: str
    request: Request


@dataclass(frozen=True, slots=True)
class Relay:
    """Request to the running session, as from a second terminal: a note, a pause, a stop."""

    request: Request


@dataclass(frozen=True, slots=True)
class LetGo:
    """Ctrl-C: force off at once, in any state of the engine. What it is doing ends; a session can be resumed."""


@dataclass(frozen=True, slots=True)
class Heartbeat:
    """The event loop of the screen is alive. Ten times a second."""


@dataclass(frozen=True, slots=True)
class Reply:
    """Reply to the `Ask` or `LayDown` of the same number. Replies to a question that is over are ignored."""

    number: int
    value: Any


Command = (
    ShowHome
    | ShowSession
    | ShowDiagnosis
    | Begin
    | Resume
    | Analyze
    | Withdraw
    | Diagnose
    | CalibrateSensor
    | KeepSensor
    | AskOtherSession
)
"""Commands that the engine performs one after another."""

ToEngine = Command | Relay | LetGo | Heartbeat | Reply
"""Any message from the screen."""
