"""Facts of a sitting around its trials: forms, checks, demonstrations, rests, pauses, notes, the end."""

from typing import Literal

from pydantic import ConfigDict
from pydantic.dataclasses import dataclass

from study.session.facts.fact_types import (
    AngleDeg,
    Count,
    ForceN,
    FrequencyHz,
    Index,
    Magnitude,
    RecordingPath,
    Seconds,
    Sha256,
    UtcTime,
)

FACT = ConfigDict(extra="forbid", allow_inf_nan=False)


@dataclass(frozen=True, config=FACT)
class DoseElsewhere:
    """What the same hand got since its last night's rest in other sessions of the participant, see `Dose`."""

    sessions: tuple[str, ...]
    squared_s: Magnitude
    vibrated_s: Seconds
    unmeasured_s: Seconds
    still_s: Seconds
    """Since it last moved in any of them."""
    unread: tuple[str, ...] = ()
    """Sessions that cannot be read: nothing of them is counted."""


@dataclass(frozen=True, config=FACT)
class FormFilled:
    """Consent, exclusion, questions before the trials, set-up or debrief. What a form asks for the moment only (why a
    person may not take part) is not kept: `answers` holds what the study needs."""

    utc: UtcTime
    form: Literal["consent", "exclusion", "setup", "debrief", "questionnaire"]
    version: str
    """Of the form, as its protocol states it."""
    ethics_id: str
    passed: bool
    """False: consent was not given, or a person may not take part. Always true for the other forms."""
    answers: dict[str, str]
    monotonic_s: Seconds | None = None
    event: Literal["form_filled"] = "form_filled"


@dataclass(frozen=True, config=FACT)
class PlaceTaken:
    """A person takes part: consent, exclusion questions, set-up and device check are passed."""

    utc: UtcTime
    participant_number: Count
    """How many participants of this protocol took their places before; from here on this one holds, not that of the
    opening line."""
    monotonic_s: Seconds | None = None
    event: Literal["place_taken"] = "place_taken"


@dataclass(frozen=True, config=FACT)
class DeviceChecked:
    utc: UtcTime
    passed: bool
    findings: tuple[str, ...]
    """One sentence each."""
    monotonic_s: Seconds | None = None
    event: Literal["device_checked"] = "device_checked"


@dataclass(frozen=True, config=FACT)
class DemoPlayed:
    """A labelled demonstration, written before the device moves."""

    utc: UtcTime
    frequency_hz: FrequencyHz
    level_n: ForceN
    direction: Literal[1, 2]
    """The number on the screen."""
    angle_deg: AngleDeg
    seconds: Seconds
    monotonic_s: Seconds | None = None
    event: Literal["demo_played"] = "demo_played"


@dataclass(frozen=True, config=FACT)
class OnsetPulsed:
    """A pulse on the lab's line, sent as the device had begun the trial's force; logged when the trial is over."""

    utc: UtcTime
    run: Index
    trial: Index
    attempt: Index
    line: str
    pulsed_s: Seconds | None
    """Monotonic clock of the session as the line had taken it; null: lost, see `trouble`."""
    trouble: str = ""
    monotonic_s: Seconds | None = None
    event: Literal["onset_pulsed"] = "onset_pulsed"


@dataclass(frozen=True, config=FACT)
class ProbePlayed:
    """A known force between trials, written before the device moves."""

    utc: UtcTime
    number: Index
    """Counts all probes of the session, from 0."""
    kind: Literal["hand", "free", "reference"]
    """With a hand; as a test whether the handle is free; the reference."""
    level_n: ForceN
    """Peak of the norm."""
    monotonic_s: Seconds | None = None
    event: Literal["probe_played"] = "probe_played"


@dataclass(frozen=True, config=FACT)
class ProbeMeasured:
    """What came of the probe that was played last. One without this line was cut off by the program's end."""

    utc: UtcTime
    number: Index
    vibrated_s: Seconds
    recording: RecordingPath | None = None
    sha256: Sha256 | None = None
    rms_mps2: Magnitude | None = None
    """Of the measured acceleration, all axes together; null where nothing was kept."""
    apparent_mass_kg: Magnitude | None = None
    """Force over acceleration at its upper lines: a hand on the handle adds to it."""
    trouble: str = ""
    """Why nothing was kept of it, or what speaks against using it."""
    monotonic_s: Seconds | None = None
    event: Literal["probe_measured"] = "probe_measured"


@dataclass(frozen=True, config=FACT)
class MaskingPlayed:
    """From here on the program plays masking noise, or does no more."""

    utc: UtcTime
    playing: bool
    output: str
    level_db: float
    """Re the file of `hapteq noise`."""
    low_hz: FrequencyHz
    high_hz: FrequencyHz
    seed: Count
    trouble: str = ""
    """Why it fell silent, where it was not stopped."""
    monotonic_s: Seconds | None = None
    event: Literal["masking_played"] = "masking_played"


@dataclass(frozen=True, config=FACT)
class DemoFinished:
    utc: UtcTime
    monotonic_s: Seconds | None = None
    event: Literal["demo_finished"] = "demo_finished"


@dataclass(frozen=True, config=FACT)
class RestTaken:
    utc: UtcTime
    run: Index
    trial: Index
    """Index of the trial that comes after the rest."""
    rested_s: Seconds
    monotonic_s: Seconds | None = None
    event: Literal["rest_taken"] = "rest_taken"


@dataclass(frozen=True, config=FACT)
class PauseTaken:
    utc: UtcTime
    who: Literal["participant", "experimenter", "program"]
    paused_s: Seconds
    monotonic_s: Seconds | None = None
    event: Literal["pause_taken"] = "pause_taken"


@dataclass(frozen=True, config=FACT)
class NoteTaken:
    utc: UtcTime
    who: Literal["participant", "experimenter", "program"]
    text: str
    adverse: bool = False
    """Something happened to the participant: pain, numbness, a fright."""
    monotonic_s: Seconds | None = None
    event: Literal["note_taken"] = "note_taken"


@dataclass(frozen=True, config=FACT)
class SessionClosed:
    """Last line of a session that is over: finished, or final because the person does not take part."""

    utc: UtcTime
    outcome: Literal["completed", "refused", "excluded"]
    monotonic_s: Seconds | None = None
    event: Literal["session_closed"] = "session_closed"
