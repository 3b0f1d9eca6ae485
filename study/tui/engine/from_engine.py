"""Messages from the engine to the screen. Values only, pickled over a pipe, light to import."""

from dataclasses import dataclass
from enum import Enum
from typing import Any

from protocols.wording.words import Words
from study.session.views.archive_views import DiagnosisView, HomeView, SessionView
from study.session.views.views import HandleView


class Call(Enum):
    """Methods of the display port that wait for a reply."""

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
    """Show this and send the reply. `shown` is what the display port names: a view or a sentence."""

    number: int
    call: Call
    shown: Any


@dataclass(frozen=True, slots=True)
class LookUpdate:
    """Current handle position, while `Call.AWAIT_HANDLE` of this number waits."""

    number: int
    view: HandleView


@dataclass(frozen=True, slots=True)
class Close:
    """The reply of this number is no longer needed."""

    number: int


@dataclass(frozen=True, slots=True)
class Feedback:
    """Whether an answer was right, where the protocol shows it."""

    correct: bool


@dataclass(frozen=True, slots=True)
class Trouble:
    """A message that ends nothing."""

    sentence: str


@dataclass(frozen=True, slots=True)
class Home:
    """Content of the start screen."""

    view: HomeView


@dataclass(frozen=True, slots=True)
class Session:
    """Content of a past session's screen."""

    view: SessionView


@dataclass(frozen=True, slots=True)
class Diagnosis:
    """Content of a diagnosis' screen."""

    view: DiagnosisView


@dataclass(frozen=True, slots=True)
class ParticipantWords:
    """What the participant of the sitting reads, from here on."""

    words: Words


@dataclass(frozen=True, slots=True)
class Preparing:
    """A longer preparation, as a sentence."""

    sentence: str


@dataclass(frozen=True, slots=True)
class Working:
    """Current step of longer work, and the share that is done."""

    what: str
    share: float


@dataclass(frozen=True, slots=True)
class LayDown:
    """Lay the accelerometer down like this and send a `Reply`."""

    number: int
    """From 1."""
    position: str
    heard: tuple[float, float, float] | None
    """Mean raw values in the position before."""


@dataclass(frozen=True, slots=True)
class Calibrated:
    """All six positions are known."""

    table: str
    """Table of the lab's file, TOML."""
    file: str


@dataclass(frozen=True, slots=True)
class SensorKept:
    """The calibration was written to this file."""

    file: str


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
    """Results of a finished session, as the command line prints them."""

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
    """A command failed or was left: also for a sitting that was left."""

    error: ErrorText
    path: str = ""
    """Path of the session that can be resumed, where one was opened."""


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
    | ParticipantWords
    | Working
    | LayDown
    | Calibrated
    | SensorKept
    | Opened
    | Finished
    | Withdrawn
    | Failed
)  # fmt: skip
"""Any message from the engine."""
