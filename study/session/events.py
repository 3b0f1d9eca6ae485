"""The facts of a session, one JSON line each in `events.jsonl`.

A fact is what the program cannot recompute: what was opened, presented, answered, measured. Whatever follows from
facts (levels, reversals, thresholds) is folded from them; where it is written too, it is there as a check.
"""

from typing import Annotated, Literal

from pydantic import Field, TypeAdapter
from pydantic.dataclasses import dataclass

from protocols.trial import Phase
from study.session.level_scale import EqualizedFacts
from study.session.sitting_events import (
    FACT,
    DemoFinished,
    DemoPlayed,
    DeviceChecked,
    FormFilled,
    NoteTaken,
    PauseTaken,
)

__all__ = [
    "EVENTS",
    "SESSION_FORMAT",
    "SESSION_VERSION",
    "AnswerGiven",
    "DemoFinished",
    "DemoPlayed",
    "DeviceChecked",
    "DeviceFacts",
    "Event",
    "FormFilled",
    "NoteTaken",
    "PauseTaken",
    "RestTaken",
    "SessionClosed",
    "SessionInterrupted",
    "SessionOpened",
    "SessionResumed",
    "TrialMeasured",
    "TrialPresented",
    "TrialSpoiled",
    "event_line",
    "parse_event",
]

SESSION_FORMAT: Literal["hapteq-session"] = "hapteq-session"
SESSION_VERSION: Literal[1] = 1


@dataclass(frozen=True, config=FACT)
class DeviceFacts:
    name: str
    simulated: bool
    sample_rate_hz: float
    details: str = ""


@dataclass(frozen=True, config=FACT)
class SessionOpened:
    """First line of every log: all that the rest follows from."""

    utc: str
    format: Literal["hapteq-session"]
    version: Literal[1]
    session: str
    subject: str
    participant_number: Annotated[int, Field(ge=0)]
    """How many participants began this protocol before: chooses the row of a balanced order."""
    observer: str | None
    """Name of the simulated participant; null for a person."""
    protocol_text: str
    protocol_hash: str
    protocol_locked: bool
    seed: Annotated[int, Field(ge=0)]
    device: DeviceFacts
    equalizer: str
    versions: dict[str, str]
    equalized: EqualizedFacts | None = None
    """Null: the commanded force is what was wanted."""
    event: Literal["session_opened"] = "session_opened"


@dataclass(frozen=True, config=FACT)
class TrialPresented:
    """Written before the device moves."""

    utc: str
    run: int
    trial: int
    attempt: int
    phase: Phase
    frequency_hz: float
    level_db: float
    level_n: float
    direction: Literal[1, 2]
    """The number that is the right answer; with swapped labels not the number of the protocol's direction."""
    angle_deg: float
    polarity: Literal[-1, 1]
    wanted_mps2: float | None = None
    """The acceleration that the level stands for; null where levels are commanded forces."""
    event: Literal["trial_presented"] = "trial_presented"


@dataclass(frozen=True, config=FACT)
class AnswerGiven:
    """Written before anything reacts to it."""

    utc: str
    run: int
    trial: int
    attempt: int
    answer: Literal[1, 2]
    response_time_s: float
    event: Literal["answer_given"] = "answer_given"


@dataclass(frozen=True, config=FACT)
class TrialMeasured:
    """What the device did in an answered trial. It closes the trial: the answer counts."""

    utc: str
    run: int
    trial: int
    attempt: int
    status: Literal["ok", "flagged", "unmeasured"]
    flags: tuple[str, ...] = ()
    recording: str | None = None
    sha256: str | None = None
    delivered_mps2: float | None = None
    off_axis_mps2: float | None = None
    displacement_mm: float | None = None
    missed_ticks: int | None = None
    vibrated_s: float | None = None
    """How long the hand was shaken, fades included: for the vibration dose."""
    offset_mm: float | None = None
    """Farthest the handle was from its place while recorded: a lean on the spring."""
    event: Literal["trial_measured"] = "trial_measured"


@dataclass(frozen=True, config=FACT)
class TrialSpoiled:
    """The presentation is void, answered or not; the trial is drawn again as the next attempt."""

    utc: str
    run: int
    trial: int
    attempt: int
    reason: str
    missed_ticks: int | None = None
    vibrated_s: float | None = None
    event: Literal["trial_spoiled"] = "trial_spoiled"


@dataclass(frozen=True, config=FACT)
class RestTaken:
    utc: str
    run: int
    trial: int
    """Index of the trial that comes after the rest."""
    rested_s: float
    event: Literal["rest_taken"] = "rest_taken"


@dataclass(frozen=True, config=FACT)
class SessionInterrupted:
    """Somebody left on purpose, or a fault ended the sitting. It can be resumed."""

    utc: str
    reason: str
    event: Literal["session_interrupted"] = "session_interrupted"


@dataclass(frozen=True, config=FACT)
class SessionResumed:
    utc: str
    device: DeviceFacts
    versions: dict[str, str]
    mended: str = ""
    """A torn last line that a crash left behind, kept here for the record."""
    event: Literal["session_resumed"] = "session_resumed"


@dataclass(frozen=True, config=FACT)
class SessionClosed:
    """Last line of a finished session."""

    utc: str
    outcome: Literal["completed"]
    event: Literal["session_closed"] = "session_closed"


Event = (
    SessionOpened
    | TrialPresented
    | AnswerGiven
    | TrialMeasured
    | TrialSpoiled
    | RestTaken
    | FormFilled
    | DeviceChecked
    | DemoPlayed
    | DemoFinished
    | PauseTaken
    | NoteTaken
    | SessionInterrupted
    | SessionResumed
    | SessionClosed
)

EVENTS: TypeAdapter[Event] = TypeAdapter(Annotated[Event, Field(discriminator="event")])


def event_line(event: Event) -> bytes:
    """One line of JSON, newline included."""
    return EVENTS.dump_json(event) + b"\n"


def parse_event(line: bytes) -> Event:
    """Raises pydantic.ValidationError (a ValueError) where the line is no event of ours."""
    return EVENTS.validate_json(line, strict=False)
