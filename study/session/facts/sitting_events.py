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
"""Of every logged fact: no unknown fields, no NaN or infinity."""


@dataclass(frozen=True, config=FACT)
class DoseElsewhere:
    """Vibration dose of the same hand since its last night's rest in other sessions of the participant, see `Dose`."""

    sessions: tuple[str, ...]
    squared_s: Magnitude
    vibrated_s: Seconds
    unmeasured_s: Seconds
    still_s: Seconds
    """Seconds since the hand last moved in any of them."""
    unread: tuple[str, ...] = ()
    """Sessions that cannot be read and are not included."""


@dataclass(frozen=True, config=FACT)
class FormFilled:
    """Answers to a form: consent, exclusion, questions before the trials, set-up or debrief. Answers that matter only
    at the moment (why a person may not take part) are not kept: `answers` contains what the study needs."""

    utc: UtcTime
    form: Literal["consent", "exclusion", "setup", "debrief", "questionnaire"]
    version: str
    """Version of the form, as stated by its protocol."""
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
    """Number of participants of this protocol who took their places before; it replaces the number of the opening
    line."""
    monotonic_s: Seconds | None = None
    event: Literal["place_taken"] = "place_taken"


@dataclass(frozen=True, config=FACT)
class DeviceChecked:
    """Result of the device check before a sitting."""

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
    """Number of the direction on the screen."""
    angle_deg: AngleDeg
    seconds: Seconds
    monotonic_s: Seconds | None = None
    event: Literal["demo_played"] = "demo_played"


@dataclass(frozen=True, config=FACT)
class OnsetPulsed:
    """A trigger pulse on the lab's line at the onset of the trial's force; logged when the trial is over."""

    utc: UtcTime
    run: Index
    trial: Index
    attempt: Index
    line: str
    pulsed_s: Seconds | None
    """Monotonic time of the session at which the line accepted the pulse; null: lost, see `trouble`."""
    trouble: str = ""
    monotonic_s: Seconds | None = None
    event: Literal["onset_pulsed"] = "onset_pulsed"


@dataclass(frozen=True, config=FACT)
class ProbePlayed:
    """A known force between trials, written before the device moves."""

    utc: UtcTime
    number: Index
    """Number of the probe in the session, from 0."""
    kind: Literal["hand", "free", "reference"]
    """Kind: with a hand on the handle; a test whether the handle is free; the reference."""
    level_n: ForceN
    """Peak of the norm of the force."""
    monotonic_s: Seconds | None = None
    event: Literal["probe_played"] = "probe_played"


@dataclass(frozen=True, config=FACT)
class ProbeMeasured:
    """Result of the last probe. A probe without this line was cut off by the program's end."""

    utc: UtcTime
    number: Index
    vibrated_s: Seconds
    recording: RecordingPath | None = None
    sha256: Sha256 | None = None
    rms_mps2: Magnitude | None = None
    """Rms of the measured acceleration, all axes together; null without a recording."""
    apparent_mass_kg: Magnitude | None = None
    """Apparent mass: force over acceleration at the upper lines; a hand on the handle increases it."""
    trouble: str = ""
    """Why there is no recording, or why it should not be used."""
    monotonic_s: Seconds | None = None
    event: Literal["probe_measured"] = "probe_measured"


@dataclass(frozen=True, config=FACT)
class MaskingPlayed:
    """The program starts or stops playing masking noise."""

    utc: UtcTime
    playing: bool
    output: str
    level_db: float
    """Level relative to the file of `hapteq noise`."""
    low_hz: FrequencyHz
    high_hz: FrequencyHz
    seed: Count
    trouble: str = ""
    """Why it stopped, where it was not stopped on purpose."""
    monotonic_s: Seconds | None = None
    event: Literal["masking_played"] = "masking_played"


@dataclass(frozen=True, config=FACT)
class DemoFinished:
    """The participant ended the labelled demonstration."""

    utc: UtcTime
    monotonic_s: Seconds | None = None
    event: Literal["demo_finished"] = "demo_finished"


@dataclass(frozen=True, config=FACT)
class RestTaken:
    """An enforced rest is over."""

    utc: UtcTime
    run: Index
    trial: Index
    """Index of the trial that comes after the rest."""
    rested_s: Seconds
    monotonic_s: Seconds | None = None
    event: Literal["rest_taken"] = "rest_taken"


@dataclass(frozen=True, config=FACT)
class PauseTaken:
    """A pause is over."""

    utc: UtcTime
    who: Literal["participant", "experimenter", "program"]
    paused_s: Seconds
    monotonic_s: Seconds | None = None
    event: Literal["pause_taken"] = "pause_taken"


@dataclass(frozen=True, config=FACT)
class NoteTaken:
    """A note for the log, or a report of an adverse event."""

    utc: UtcTime
    who: Literal["participant", "experimenter", "program"]
    text: str
    adverse: bool = False
    """An adverse event of the participant: pain, numbness, a fright."""
    monotonic_s: Seconds | None = None
    event: Literal["note_taken"] = "note_taken"


@dataclass(frozen=True, config=FACT)
class SessionClosed:
    """Last line of a session that is over: finished, or final because the person does not take part."""

    utc: UtcTime
    outcome: Literal["completed", "refused", "excluded"]
    monotonic_s: Seconds | None = None
    event: Literal["session_closed"] = "session_closed"
