"""Logged events of a session (its facts): one JSON line each in `events.jsonl`; their parser and formatter.

A fact is an observation that the program cannot recompute, such as a presented stimulus, an answer or a measurement.
Quantities that follow from facts (levels, reversals, thresholds) are computed from them (`study.session.state.fold`);
where a fact states one of them, too, it serves as a check.

In all events, `run`, `trial` and `attempt` are indices from 0, `utc` is the wall-clock time, and `monotonic_s` is as in
`sitting_events`. Units are in the names; ranges are in `fact_types`.
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
    FACT_CONFIG,
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
    "encode_event",
    "parse_event",
]

SESSION_FORMAT: Literal["hapteq-session"] = "hapteq-session"
"""Name of the format, in the opening line of a log."""
SESSION_VERSION: Literal[1] = 1
"""Version of the format of the log; facts and fields may be added within it."""

ADDED_FIELD_DEFAULTS: dict[str, object] = {
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
"""Defaults of fields that were added after the first logs; such a field is not written where it has its default."""


@dataclass(frozen=True, config=FACT_CONFIG)
class DeviceFacts:
    """The device of a session: its name, whether it is simulated, the rate of its control loop (Hz), and further
    details in words."""

    name: str
    simulated: bool
    sample_rate_hz: Positive
    details: str = ""


@dataclass(frozen=True, config=FACT_CONFIG)
class SessionOpened:
    """First line of every log: names of session and participant (`subject`), and all settings on which the session
    depends."""

    utc: UtcTime
    format: Literal["hapteq-session"]
    version: Literal[1]
    session: str
    subject: str
    participant_number: Index
    """Number of participants who began this protocol before; it selects the row of the counterbalanced order. Later
    replaced by that of `PlaceTaken`, if there is one."""
    observer: str | None
    """Name of the simulated participant; null for a person."""
    protocol_text: str
    protocol_hash: Sha256
    protocol_locked: bool
    seed: Seed
    device: DeviceFacts
    equalizer: str
    """Name of the method that converts a target stimulus to commanded forces."""
    versions: dict[str, str]
    """Versions of Python and of the packages that hapteq uses, by name."""
    equalized: EqualizedFacts | None = None
    """Model and level scales of the equalizer; null: commanded and target force are the same."""
    monotonic_s: Seconds | None = None
    dose_elsewhere: DoseElsewhere | None = None
    rules: Literal[1, 2] = 1
    """Version of the rules for void trials, refusals and participant numbers (`study.session.state.rules`); a session
    keeps it."""
    event: Literal["session_opened"] = "session_opened"


@dataclass(frozen=True, config=FACT_CONFIG)
class TrialPresented:
    """The stimulus of a trial; logged before the device moves."""

    utc: UtcTime
    run: Index
    trial: Index
    attempt: Index
    phase: Phase
    frequency_hz: FrequencyHz
    level_db: LevelDb
    """Level in dB relative to 1 N."""
    level_n: ForceN
    """Amplitude of the force; for equalized stimuli, the level (`level_scale`)."""
    direction: Literal[1, 2]
    """Number of the correct answer; with swapped labels it differs from the number of the protocol's direction."""
    angle_deg: AngleDeg
    """Angle of the played direction in the plane of the test directions."""
    polarity: Literal[-1, 1]
    """Sign of the force at its onset."""
    wanted_mps2: Magnitude | None = None
    """Target acceleration that the level stands for; null where levels are commanded forces."""
    nominal_n: ForceN | None = None
    """Level of the staircase, around which the amplitude was drawn; null without roving."""
    monotonic_s: Seconds | None = None
    event: Literal["trial_presented"] = "trial_presented"


@dataclass(frozen=True, config=FACT_CONFIG)
class TrialMeasured:
    """Measurement of an answered trial; it closes the trial, and the answer counts."""

    utc: UtcTime
    run: Index
    trial: Index
    attempt: Index
    status: Literal["ok", "flagged", "unmeasured"]
    """`flagged`: with `flags`; `unmeasured`: no acceleration was measured."""
    flags: tuple[str, ...] = ()
    recording: RecordingPath | None = None
    sha256: Sha256 | None = None
    """Hash of the file `recording`; null where none was kept."""
    delivered_mps2: Measured | None = None
    off_axis_mps2: Measured | None = None
    """Amplitudes of the delivered acceleration at the stimulus frequency (m/s²), along the direction (`delivered_mps2`)
    and across it. These and the next two as in `study.session.stimulus.delivered`; null where not measured."""
    displacement_mm: Measured | None = None
    """Amplitude of the displacement along the direction (mm)."""
    harmonics_mps2: Magnitude | None = None
    """Root of the summed squares of the amplitudes at 2 to 5 times the stimulus frequency (m/s²)."""
    missed_ticks: Count | None = None
    late_ticks: Count | None = None
    latest_s: Seconds | None = None
    """These three as in `AnswerHealth`, at the end of the stimulus."""
    vibrated_s: Seconds | None = None
    """Duration of the vibration (s), fades included, for the vibration dose."""
    offset_mm: Magnitude | None = None
    """Largest distance of the handle from its rest position during the recording (mm): large if the participant leaned
    on the spring."""
    sensor: SensorFacts | None = None
    """Facts about the accelerometer; null where the acceleration is read with each tick, and in logs of older
    versions."""
    monotonic_s: Seconds | None = None
    event: Literal["trial_measured"] = "trial_measured"


@dataclass(frozen=True, config=FACT_CONFIG)
class TrialSpoiled:
    """The presentation is void, answered or not; the trial is presented again as the next attempt."""

    utc: UtcTime
    run: Index
    trial: Index
    attempt: Index
    reason: str
    """Cause of the void presentation, a clause."""
    missed_ticks: Count | None = None
    late_ticks: Count | None = None
    latest_s: Seconds | None = None
    vibrated_s: Seconds | None = None
    monotonic_s: Seconds | None = None
    cause: VoidCause | None = None
    """Kind of the reason; null in logs of versions that did not record it."""
    sensor: SensorFacts | None = None
    event: Literal["trial_spoiled"] = "trial_spoiled"


@dataclass(frozen=True, config=FACT_CONFIG)
class SessionInterrupted:
    """The sitting was ended by the participant, the experimenter or a fault; the session can be resumed."""

    utc: UtcTime
    reason: str
    monotonic_s: Seconds | None = None
    event: Literal["session_interrupted"] = "session_interrupted"


@dataclass(frozen=True, config=FACT_CONFIG)
class SessionResumed:
    """A session continues after a crash or a pause, possibly with another device or version of the program."""

    utc: UtcTime
    device: DeviceFacts
    versions: dict[str, str]
    mended: str = ""
    """Incomplete last line of the log after a crash, which was removed from the log; empty without one."""
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
"""Any logged event of a session."""

EVENTS: TypeAdapter[Event] = TypeAdapter(Annotated[Event, Field(discriminator="event")])
"""Validator and serializer of events; the field `event` states the kind."""


def encode_event(event: Event) -> bytes:
    """Encode an event as a line of JSON in UTF-8, newline included. Fields of `ADDED_FIELD_DEFAULTS` are left out where
    they have their default."""
    omitted_fields = {
        name for name, default in ADDED_FIELD_DEFAULTS.items() if getattr(event, name, default) == default
    }
    return EVENTS.dump_json(event, exclude=omitted_fields) + b"\n"


def parse_event(line: bytes) -> Event:
    """Parse a line of the log, without its checksum. Raises pydantic.ValidationError (a ValueError) where it is no
    event of this format."""
    return EVENTS.validate_json(line, strict=True)
