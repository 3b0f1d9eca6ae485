"""The facts of a session, one JSON line each in `events.jsonl`.

A fact is what the program cannot recompute: what was opened, presented, answered, measured. Quantities that follow from
facts (levels, reversals, thresholds) are computed from them (`study.session.state.fold`); where a fact states one of
them, too, it serves as a check.
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
"""Name of the format, in the opening line of a log."""
SESSION_VERSION: Literal[1] = 1
"""Version of the format of the log; facts and fields may be added within it."""

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
"""Defaults of fields that were added after the first logs; fields with these values are not written."""


@dataclass(frozen=True, config=FACT)
class DeviceFacts:
    """The device of a session: its name, whether it is simulated, and the rate of its control loop (Hz)."""

    name: str
    simulated: bool
    sample_rate_hz: Positive
    details: str = ""


@dataclass(frozen=True, config=FACT)
class SessionOpened:
    """First line of every log: everything that the rest of the session depends on."""

    utc: UtcTime
    format: Literal["hapteq-session"]
    version: Literal[1]
    session: str
    subject: str
    participant_number: Index
    """Number of participants who began this protocol before; it selects the row of a balanced order."""
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
    """Equalizer of the stimuli; null: commanded and wanted force are the same."""
    monotonic_s: Seconds | None = None
    dose_elsewhere: DoseElsewhere | None = None
    rules: Literal[1, 2] = 1
    """Version of the rules for void trials, refusals and places, see `state.rules`. A session keeps the version that it
    began with."""
    event: Literal["session_opened"] = "session_opened"


@dataclass(frozen=True, config=FACT)
class TrialPresented:
    """The stimulus of a trial. Written before the device moves."""

    utc: UtcTime
    run: Index
    trial: Index
    attempt: Index
    phase: Phase
    frequency_hz: FrequencyHz
    level_db: LevelDb
    level_n: ForceN
    direction: Literal[1, 2]
    """Number of the correct answer; with swapped labels it differs from the number of the protocol's direction."""
    angle_deg: AngleDeg
    polarity: Literal[-1, 1]
    wanted_mps2: Magnitude | None = None
    """Wanted acceleration of the level; null where levels are commanded forces."""
    nominal_n: ForceN | None = None
    """Level of the staircase, around which the amplitude was drawn; null without roving."""
    monotonic_s: Seconds | None = None
    event: Literal["trial_presented"] = "trial_presented"


@dataclass(frozen=True, config=FACT)
class TrialMeasured:
    """Measurement of an answered trial. It closes the trial: the answer counts."""

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
    """Amplitudes of the delivered acceleration at the stimulus frequency (m/s²), along the direction (`delivered_mps2`)
    and across it."""
    displacement_mm: Measured | None = None
    harmonics_mps2: Magnitude | None = None
    missed_ticks: Count | None = None
    late_ticks: Count | None = None
    latest_s: Seconds | None = None
    vibrated_s: Seconds | None = None
    """Duration of the vibration (s), fades included, for the vibration dose."""
    offset_mm: Magnitude | None = None
    """Largest distance of the handle from its place during the recording (mm): large if the participant leaned on the
    spring."""
    sensor: SensorFacts | None = None
    """Null where the acceleration is read with each tick, and in logs of older versions."""
    monotonic_s: Seconds | None = None
    event: Literal["trial_measured"] = "trial_measured"


@dataclass(frozen=True, config=FACT)
class TrialSpoiled:
    """The presentation is void, answered or not; the trial is repeated as the next attempt."""

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
    """Null in logs of versions that did not record causes."""
    sensor: SensorFacts | None = None
    event: Literal["trial_spoiled"] = "trial_spoiled"


@dataclass(frozen=True, config=FACT)
class SessionInterrupted:
    """The participant or experimenter ended the sitting, or a fault did. The session can be resumed."""

    utc: UtcTime
    reason: str
    monotonic_s: Seconds | None = None
    event: Literal["session_interrupted"] = "session_interrupted"


@dataclass(frozen=True, config=FACT)
class SessionResumed:
    """A session continues after a crash or a pause, possibly with another device or version of the program."""

    utc: UtcTime
    device: DeviceFacts
    versions: dict[str, str]
    mended: str = ""
    """An incomplete last line that a crash left behind; it was removed from the log and is kept here."""
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
"""Any fact of a session."""

EVENTS: TypeAdapter[Event] = TypeAdapter(Annotated[Event, Field(discriminator="event")])
"""Reads and writes facts; the field `event` states the kind of a fact."""


def event_line(event: Event) -> bytes:
    """One line of JSON, newline included. Fields that earlier versions did not log are left out where they have their
    default value."""
    unsaid = {name for name, untouched in FIELDS_SINCE.items() if getattr(event, name, untouched) == untouched}
    return EVENTS.dump_json(event, exclude=unsaid) + b"\n"


def parse_event(line: bytes) -> Event:
    """Parse a line of the log. Raises pydantic.ValidationError (a ValueError) where the line is not a fact of this
    format."""
    return EVENTS.validate_json(line, strict=True)
