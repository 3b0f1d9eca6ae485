"""The facts of a session, one JSON line each in `events.jsonl`.

A fact is what the program cannot recompute: what was opened, presented, answered, measured. What follows from
facts (levels, reversals, thresholds) is folded from them; where it is written too, it is there as a check.
"""

from typing import Annotated, Literal

from pydantic import Field, TypeAdapter
from pydantic.dataclasses import dataclass

from protocols.trial import Phase, VoidCause
from study.session.facts.answer_given import AnswerGiven
from study.session.facts.fact_types import (
    AngleDeg,
    Count,
    ForceN,
    FrequencyHz,
    Index,
    LevelDb,
    Magnitude,
    Measured,
    Positive,
    RecordingPath,
    Seconds,
    Seed,
    Sha256,
    UtcTime,
)
from study.session.facts.level_scale import EqualizedFacts
from study.session.facts.sensor_facts import SensorFacts
from study.session.facts.sitting_events import (
    FACT,
    DemoFinished,
    DemoPlayed,
    DeviceChecked,
    DoseElsewhere,
    FormFilled,
    MaskingPlayed,
    NoteTaken,
    OnsetPulsed,
    PauseTaken,
    PlaceTaken,
    ProbeMeasured,
    ProbePlayed,
    RestTaken,
    SessionClosed,
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
    "MaskingPlayed",
    "NoteTaken",
    "OnsetPulsed",
    "PauseTaken",
    "PlaceTaken",
    "ProbeMeasured",
    "ProbePlayed",
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

FIELDS_SINCE: dict[str, object] = {
    "monotonic_s": None,
    "dose_elsewhere": None,
    "rules": 1,
    "cause": None,
    "health": None,
    "late_ticks": None,
    "latest_s": None,
    "harmonics_mps2": None,
    "nominal_n": None,
    "sensor": None,
}
"""Fields that came after the first logs, as they are where a line does not say them: then they are not written."""


@dataclass(frozen=True, config=FACT)
class DeviceFacts:
    name: str
    simulated: bool
    sample_rate_hz: Positive
    details: str = ""


@dataclass(frozen=True, config=FACT)
class SessionOpened:
    """First line of every log: all that the rest follows from."""

    utc: UtcTime
    format: Literal["hapteq-session"]
    version: Literal[1]
    session: str
    subject: str
    participant_number: Index
    """How many participants began this protocol before: chooses the row of a balanced order."""
    observer: str | None
    """Name of the simulated participant; null for a person."""
    protocol_text: str
    protocol_hash: Sha256
    protocol_locked: bool
    seed: Seed
    device: DeviceFacts
    equalizer: str
    versions: dict[str, str]
    equalized: EqualizedFacts | None = None
    """Null: the commanded force is what was wanted."""
    monotonic_s: Seconds | None = None
    dose_elsewhere: DoseElsewhere | None = None
    rules: Literal[1, 2] = 1
    """Of void trials, refusals and places, see `state.rules`. A session keeps those that it began with."""
    event: Literal["session_opened"] = "session_opened"


@dataclass(frozen=True, config=FACT)
class TrialPresented:
    """Written before the device moves."""

    utc: UtcTime
    run: Index
    trial: Index
    attempt: Index
    phase: Phase
    frequency_hz: FrequencyHz
    level_db: LevelDb
    level_n: ForceN
    direction: Literal[1, 2]
    """The number that is the right answer; with swapped labels not the number of the protocol's direction."""
    angle_deg: AngleDeg
    polarity: Literal[-1, 1]
    wanted_mps2: Magnitude | None = None
    """The acceleration that the level stands for; null where levels are commanded forces."""
    nominal_n: ForceN | None = None
    """Level of the staircase, around which the amplitude was drawn; null where nothing is roved."""
    monotonic_s: Seconds | None = None
    event: Literal["trial_presented"] = "trial_presented"


@dataclass(frozen=True, config=FACT)
class TrialMeasured:
    """What the device did in an answered trial. It closes the trial: the answer counts."""

    utc: UtcTime
    run: Index
    trial: Index
    attempt: Index
    status: Literal["ok", "flagged", "unmeasured"]
    flags: tuple[str, ...] = ()
    recording: RecordingPath | None = None
    sha256: Sha256 | None = None
    delivered_mps2: Measured | None = None
    off_axis_mps2: Measured | None = None
    displacement_mm: Measured | None = None
    harmonics_mps2: Magnitude | None = None
    missed_ticks: Count | None = None
    late_ticks: Count | None = None
    latest_s: Seconds | None = None
    vibrated_s: Seconds | None = None
    """How long the hand was shaken, fades included: for the vibration dose."""
    offset_mm: Magnitude | None = None
    """Farthest the handle was from its place while recorded: a lean on the spring."""
    sensor: SensorFacts | None = None
    """Null where the acceleration is read with each tick, and in logs of older versions."""
    monotonic_s: Seconds | None = None
    event: Literal["trial_measured"] = "trial_measured"


@dataclass(frozen=True, config=FACT)
class TrialSpoiled:
    """The presentation is void, answered or not; the trial comes again as the next attempt."""

    utc: UtcTime
    run: Index
    trial: Index
    attempt: Index
    reason: str
    missed_ticks: Count | None = None
    late_ticks: Count | None = None
    latest_s: Seconds | None = None
    vibrated_s: Seconds | None = None
    monotonic_s: Seconds | None = None
    cause: VoidCause | None = None
    """Null in logs of before there were causes."""
    sensor: SensorFacts | None = None
    event: Literal["trial_spoiled"] = "trial_spoiled"


@dataclass(frozen=True, config=FACT)
class SessionInterrupted:
    """The participant or experimenter left on purpose, or a fault ended the sitting. It can be resumed."""

    utc: UtcTime
    reason: str
    monotonic_s: Seconds | None = None
    event: Literal["session_interrupted"] = "session_interrupted"


@dataclass(frozen=True, config=FACT)
class SessionResumed:
    utc: UtcTime
    device: DeviceFacts
    versions: dict[str, str]
    mended: str = ""
    """A torn last line that a crash left behind, kept here for the record."""
    dose_elsewhere: DoseElsewhere | None = None
    monotonic_s: Seconds | None = None
    event: Literal["session_resumed"] = "session_resumed"


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
    | PlaceTaken
    | NoteTaken
    | MaskingPlayed
    | OnsetPulsed
    | ProbePlayed
    | ProbeMeasured
    | SessionInterrupted
    | SessionResumed
    | SessionClosed
)

EVENTS: TypeAdapter[Event] = TypeAdapter(Annotated[Event, Field(discriminator="event")])


def event_line(event: Event) -> bytes:
    """One line of JSON, newline included. What earlier versions did not log is left out where it is not known."""
    unsaid = {name for name, untouched in FIELDS_SINCE.items() if getattr(event, name, untouched) == untouched}
    return EVENTS.dump_json(event, exclude=unsaid) + b"\n"


def parse_event(line: bytes) -> Event:
    """Every field as its type. Raises pydantic.ValidationError (a ValueError) where the line is no event of ours."""
    return EVENTS.validate_json(line, strict=True)
