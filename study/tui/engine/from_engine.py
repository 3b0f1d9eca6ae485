"""Messages from the engine process to the screen's process, sent pickled through a pipe.

The engine process conducts sessions and reads results (`engine_commands`, `remote_display`); the screen's process shows
the terminal interface (`study.tui.app`). Messages are plain values, and the module imports no package with a slow
import, so that the interface appears quickly. `to_engine` defines the messages in the other direction.
"""

from dataclasses import dataclass
from enum import Enum
from typing import Any

from protocols.wording.words import Words
from study.errors import StudyError
from study.session.views.archive_views import DiagnosisView, HomeView, SessionView
from study.session.views.participant_views import HandleView


class DisplayCall(Enum):
    """Methods of the interface `study.workflows.trial.display.Display` that need a screen and its reply; the values are
    their names."""

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
class ScreenRequest:
    """Request to show a screen and to send its reply."""

    number: int
    """Number of the request, from 1 within a sitting; the reply has the same number."""
    call: DisplayCall
    content: Any
    """Argument of the method, for the screen."""


@dataclass(frozen=True, slots=True)
class HandleUpdate:
    """Current position of the handle, during the request `DisplayCall.AWAIT_HANDLE` of this number."""

    number: int
    view: HandleView


@dataclass(frozen=True, slots=True)
class CloseRequest:
    """Request to close the screen of the request of this number, which needs no reply any more."""

    number: int


@dataclass(frozen=True, slots=True)
class Feedback:
    """Whether the participant's last answer was correct; sent only if the protocol gives feedback."""

    correct: bool


@dataclass(frozen=True, slots=True)
class UserNotice:
    """A message to the user that ends neither the session nor a command."""

    sentence: str


@dataclass(frozen=True, slots=True)
class HomeContent:
    """Content of the start screen."""

    view: HomeView


@dataclass(frozen=True, slots=True)
class SessionContent:
    """Content of the screen of a past session."""

    view: SessionView


@dataclass(frozen=True, slots=True)
class DiagnosisContent:
    """Content of the screen of a diagnosis."""

    view: DiagnosisView


@dataclass(frozen=True, slots=True)
class ParticipantWords:
    """Texts in the language of the sitting's protocol, for all screens of the participant that follow."""

    words: Words


@dataclass(frozen=True, slots=True)
class PreparationStarted:
    """A slow preparation has begun; the sentence describes it."""

    sentence: str


@dataclass(frozen=True, slots=True)
class DiagnosisProgress:
    """Progress of a diagnosis: current step, and share of the work that is done (0 to 1)."""

    step: str
    share: float


@dataclass(frozen=True, slots=True)
class PlacementRequest:
    """Request to the user in a calibration: lay the accelerometer down in this position; the screen then sends a
    `Reply`."""

    number: int
    """Number of the position, from 1; the reply has the same number."""
    position: str
    """The position in words."""
    previous_reading: tuple[float, float, float] | None
    """Mean raw readings of the three axes in the previous position; None before the first."""


@dataclass(frozen=True, slots=True)
class CalibrationComputed:
    """The calibration is computed from all six positions, and not stored yet."""

    table: str
    """The calibration as a TOML table for the laboratory's settings file."""
    file: str
    """Path of the laboratory's settings file."""


@dataclass(frozen=True, slots=True)
class CalibrationStored:
    """The calibration was written to this file."""

    file: str


@dataclass(frozen=True, slots=True)
class SessionReady:
    """The session and its device are open; the log contains its first event and is locked against other processes."""

    session: str
    """Name of the session, as in P01_001."""
    path: str
    """Path of its folder."""
    device: str
    """Name of the device, as `open_device` takes it."""


@dataclass(frozen=True, slots=True)
class Results:
    """Results of a session, as printed on the command line."""

    table: tuple[str, ...]
    """Lines of the table of thresholds."""
    warnings: tuple[str, ...]
    """Sentences on irregularities; empty without any."""
    report: str
    """Path of the report."""
    document: str
    """Thresholds, warnings and path of the report as JSON text."""


@dataclass(frozen=True, slots=True)
class Finished:
    """All runs of a session are complete, the device is closed, and the report is written."""

    path: str
    """Path of the session's folder."""
    answers: int
    """Number of answers on disk that count."""
    results: Results


@dataclass(frozen=True, slots=True)
class Withdrawn:
    """A `Withdraw` command is complete."""

    sessions: tuple[str, ...]
    """Names of the erased sessions."""


@dataclass(frozen=True, slots=True)
class Failed:
    """A command failed or was interrupted, a sitting ended before its session was finished, or the engine failed."""

    error: StudyError
    path: str = ""
    """Path of the opened session, which can be resumed; empty if there is none."""


FromEngine = (
    ScreenRequest
    | HandleUpdate
    | CloseRequest
    | Feedback
    | UserNotice
    | HomeContent
    | SessionContent
    | DiagnosisContent
    | PreparationStarted
    | ParticipantWords
    | DiagnosisProgress
    | PlacementRequest
    | CalibrationComputed
    | CalibrationStored
    | SessionReady
    | Finished
    | Withdrawn
    | Failed
)  # fmt: skip
"""Any message from the engine."""
