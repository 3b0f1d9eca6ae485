"""What screen and engine say to each other. Values only, pickled over a pipe, and light to import."""

from dataclasses import dataclass
from enum import Enum
from typing import Any

from study.session.archive_views import DiagnosisView, HomeView, SessionView
from study.session.requests import Request
from study.session.views import HandleView


@dataclass(frozen=True, slots=True)
class SessionOrder:
    """A new session, as somebody asks for it."""

    protocol: str
    """A shipped protocol's name, or a file."""
    device: str
    subject: str
    data: str
    seed: int | None = None
    """None: drawn, and logged."""


# From the screen to the engine.


@dataclass(frozen=True, slots=True)
class ShowHome:
    data: str
    protocol: str = ""
    """What is offered first; so is the device."""
    device: str = ""


@dataclass(frozen=True, slots=True)
class ShowSession:
    path: str


@dataclass(frozen=True, slots=True)
class ShowDiagnosis:
    path: str


@dataclass(frozen=True, slots=True)
class Begin:
    order: SessionOrder


@dataclass(frozen=True, slots=True)
class Resume:
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
    """Erase all sessions of this session's participant. Whoever sends it has asked twice."""

    session: str


@dataclass(frozen=True, slots=True)
class AskBeside:
    """Ask a session that runs in another program."""

    session: str
    request: Request


@dataclass(frozen=True, slots=True)
class Relay:
    """To the running session, as a second terminal could ask for it: a note, a pause, a stop."""

    request: Request


@dataclass(frozen=True, slots=True)
class LetGo:
    """Ctrl-C: force off at once, whatever the engine is doing. What it is doing ends; a session can be resumed."""


@dataclass(frozen=True, slots=True)
class Heartbeat:
    """The event loop of the screen is alive. Ten times a second."""


@dataclass(frozen=True, slots=True)
class Reply:
    """To the `Ask` of the same number. A number that is over is ignored."""

    number: int
    value: Any


Command = ShowHome | ShowSession | ShowDiagnosis | Begin | Resume | Analyze | Withdraw | AskBeside
"""What the engine works through, one after the other."""

ToEngine = Command | Relay | LetGo | Heartbeat | Reply


# From the engine to the screen.


class Call(Enum):
    """The methods of the display port that wait for a reply."""

    FILL_IN = "fill_in"
    DEVICE_CHECKED = "device_checked"
    WELCOME = "welcome"
    CHOOSE_DEMO = "choose_demo"
    SHOW_PLAYING = "show_playing"
    AWAIT_HANDLE = "await_handle"
    ASK = "ask"
    PRACTICE_OVER = "practice_over"
    REST = "rest"
    PAUSE = "pause"
    AWAIT_RETURN = "await_return"
    GOODBYE = "goodbye"


@dataclass(frozen=True, slots=True)
class Ask:
    """Show this and send the reply. What is sent with it is what the display port names: a view or a sentence."""

    number: int
    call: Call
    shown: Any


@dataclass(frozen=True, slots=True)
class LookUpdate:
    """Where the handle is now, while `Call.AWAIT_HANDLE` of this number waits."""

    number: int
    view: HandleView


@dataclass(frozen=True, slots=True)
class Close:
    """Nobody waits for the reply of this number any more."""

    number: int


@dataclass(frozen=True, slots=True)
class Feedback:
    correct: bool


@dataclass(frozen=True, slots=True)
class Trouble:
    """A sentence to know that ends nothing."""

    sentence: str


@dataclass(frozen=True, slots=True)
class Home:
    view: HomeView


@dataclass(frozen=True, slots=True)
class Session:
    view: SessionView


@dataclass(frozen=True, slots=True)
class Diagnosis:
    view: DiagnosisView


@dataclass(frozen=True, slots=True)
class Preparing:
    """What takes a while, a sentence."""

    sentence: str


@dataclass(frozen=True, slots=True)
class Opened:
    """The session's log has its first line, and is locked."""

    session: str
    """Name."""
    path: str


@dataclass(frozen=True, slots=True)
class ErrorText:
    """A StudyError in words; its exit code says of which kind."""

    title: str
    happened: str
    saved: str
    do_now: str
    exit_code: int


@dataclass(frozen=True, slots=True)
class Results:
    """Of a finished session, as the command line prints them."""

    table: tuple[str, ...]
    warnings: tuple[str, ...]
    report: str
    document: str
    """The same as one JSON document."""


@dataclass(frozen=True, slots=True)
class Finished:
    """All runs of a session are done, the device is closed, and the report is written."""

    path: str
    answers: int
    """On disk."""
    results: Results


@dataclass(frozen=True, slots=True)
class Withdrawn:
    """A withdrawal that was asked for from the list of sessions is done."""

    sessions: tuple[str, ...]
    """Names of those that were erased."""


@dataclass(frozen=True, slots=True)
class Failed:
    """What was asked for could not be done, or not to its end: also of a sitting that somebody left."""

    error: ErrorText
    path: str = ""
    """Of the session that can be resumed, where one was opened."""


FromEngine = (
    Ask
    | LookUpdate
    | Close
    | Feedback
    | Trouble
    | Home
    | Session
    | Diagnosis
    | Preparing
    | Opened
    | Finished
    | Withdrawn
    | Failed
)  # fmt: skip
