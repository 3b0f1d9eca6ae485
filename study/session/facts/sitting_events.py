"""Logged events of a sitting except its trials: forms, checks, demonstrations, probes, rests, pauses, notes, end.

Each class with a field `event` is one kind of line of the session's log `events.jsonl`; `event` names the kind, and
`events` combines them with the events of trials in the type `Event`. `utc` is the wall-clock time, `monotonic_s` the
session's monotonic clock (s; None where it was not logged). A unit that is not stated is given by the type of the field
(`fact_types`) or the suffix of its name. A session and a sitting are defined in `study.session`.
"""

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
    Seed,
    Sha256,
    UtcTime,
)

FACT_CONFIG = ConfigDict(extra="forbid", allow_inf_nan=False)
"""Configuration of all event classes: unknown fields, NaN and infinity are refused."""


@dataclass(frozen=True, config=FACT_CONFIG)
class DoseElsewhere:
    """Vibration dose of the same hand since its last night's rest, in other sessions of the participant: a field of the
    events that begin a sitting, computed by `study.session.state.daily_dose`. squared_s, vibrated_s, unmeasured_s: as
    in `study.session.state.vibration_dose.Dose`."""

    sessions: tuple[str, ...]
    """Names of these sessions."""
    squared_s: Magnitude
    vibrated_s: Seconds
    unmeasured_s: Seconds
    still_s: Seconds
    """Time since the handle last moved in any of these sessions (s); 0 without any."""
    unread: tuple[str, ...] = ()
    """Names of sessions that could not be read and are not included."""


@dataclass(frozen=True, config=FACT_CONFIG)
class FormFilled:
    """A form that was filled in: consent, exclusion, questions before the trials, set-up or debrief. Only answers that
    the study needs are kept in `answers`; the reason why a person may not take part, for example, is not."""

    utc: UtcTime
    form: Literal["consent", "exclusion", "setup", "debrief", "questionnaire"]
    version: str
    """Version of the form, as stated by its protocol."""
    ethics_id: str
    """Number of the ethics approval, as stated by the protocol."""
    passed: bool
    """False: consent was not given, or a person may not take part. Always true for the other forms."""
    answers: dict[str, str]
    """Logged answer by the key of its question."""
    monotonic_s: Seconds | None = None
    event: Literal["form_filled"] = "form_filled"


@dataclass(frozen=True, config=FACT_CONFIG)
class PlaceTaken:
    """The participant's place in the counterbalanced order is assigned: consent, exclusion questions, set-up and device
    check were passed."""

    utc: UtcTime
    participant_number: Count
    """Participant number, from 0: that of the participant's earlier sessions of this protocol, else the number after
    the largest taken one. It replaces the number in the opening line of the log."""
    monotonic_s: Seconds | None = None
    event: Literal["place_taken"] = "place_taken"


@dataclass(frozen=True, config=FACT_CONFIG)
class DeviceChecked:
    """Result of the device check before a sitting."""

    utc: UtcTime
    passed: bool
    findings: tuple[str, ...]
    """One sentence for each finding."""
    monotonic_s: Seconds | None = None
    event: Literal["device_checked"] = "device_checked"


@dataclass(frozen=True, config=FACT_CONFIG)
class DemoPlayed:
    """A stimulus of the labelled demonstration; logged before the device moves."""

    utc: UtcTime
    frequency_hz: FrequencyHz
    level_n: ForceN
    """Amplitude of the force; for equalized stimuli, the level (`level_scale`)."""
    direction: Literal[1, 2]
    """Number of the direction as labelled on the screen."""
    angle_deg: AngleDeg
    """Angle of the direction in the plane of the test directions."""
    seconds: Seconds
    """Duration of the stimulus, as the protocol sets it."""
    monotonic_s: Seconds | None = None
    event: Literal["demo_played"] = "demo_played"


@dataclass(frozen=True, config=FACT_CONFIG)
class OnsetPulsed:
    """A trigger pulse on an output line of the laboratory, at the onset of the trial's force. It is logged after the
    answer, because writing to the disk would delay the question."""

    utc: UtcTime
    run: Index
    trial: Index
    attempt: Index
    line: str
    """Description of the output line."""
    pulsed_s: Seconds | None
    """Reading of the monotonic clock at which the line accepted the pulse; None: the pulse was lost, see `trouble`."""
    trouble: str = ""
    """Why the pulse was lost; empty otherwise."""
    monotonic_s: Seconds | None = None
    event: Literal["onset_pulsed"] = "onset_pulsed"


@dataclass(frozen=True, config=FACT_CONFIG)
class ProbePlayed:
    """A probe: a known force between two trials (`study.session.state.probe_state`), logged before the device moves."""

    utc: UtcTime
    number: Index
    """Number of the probe in the session, from 0."""
    kind: Literal["hand", "free", "reference"]
    """`hand`: with the hand on the handle; `free`: a test whether the handle is free; `reference`: the longer force
    with no hand on the handle."""
    level_n: ForceN
    """Peak of the norm of the force (N)."""
    monotonic_s: Seconds | None = None
    event: Literal["probe_played"] = "probe_played"


@dataclass(frozen=True, config=FACT_CONFIG)
class ProbeMeasured:
    """Result of the last probe. Where this event is missing after `ProbePlayed`, the program ended while the probe was
    playing. A reference that was declined has this event without `ProbePlayed`."""

    utc: UtcTime
    number: Index
    vibrated_s: Seconds
    """Duration of the force; it adds to the vibration dose only with a hand on the handle. 0 for a reference that was
    declined or cut short."""
    recording: RecordingPath | None = None
    sha256: Sha256 | None = None
    """SHA-256 of the recording; None without a recording."""
    rms_mps2: Magnitude | None = None
    """Root mean square of the norm of the measured acceleration (m/s²); None without a recording, or where
    samples of it are missing."""
    apparent_mass_kg: Magnitude | None = None
    """Apparent mass (kg): median of the real part of force over acceleration at the upper lines of the multisine. A
    hand on the handle increases it. None where it could not be estimated."""
    trouble: str = ""
    """Why there is no recording, or why it should not be used; empty otherwise."""
    monotonic_s: Seconds | None = None
    event: Literal["probe_measured"] = "probe_measured"


@dataclass(frozen=True, config=FACT_CONFIG)
class MaskingPlayed:
    """The masking noise, which makes the device inaudible, was started or stopped."""

    utc: UtcTime
    playing: bool
    """Whether it was started."""
    output: str
    """Name of the sound output."""
    level_db: float
    """Level in dB relative to the sound file that `hapteq noise` writes."""
    low_hz: FrequencyHz
    """Lower end of the band of the noise."""
    high_hz: FrequencyHz
    """Upper end of the band of the noise."""
    seed: Seed
    """Seed of the noise, which makes it reproducible."""
    trouble: str = ""
    """Why the noise stopped, where it was not stopped on purpose; empty otherwise."""
    monotonic_s: Seconds | None = None
    event: Literal["masking_played"] = "masking_played"


@dataclass(frozen=True, config=FACT_CONFIG)
class DemoFinished:
    """The participant ended the labelled demonstration."""

    utc: UtcTime
    monotonic_s: Seconds | None = None
    event: Literal["demo_finished"] = "demo_finished"


@dataclass(frozen=True, config=FACT_CONFIG)
class RestTaken:
    """An enforced rest has ended."""

    utc: UtcTime
    run: Index
    trial: Index
    """Index of the trial that comes after the rest."""
    rested_s: Seconds
    monotonic_s: Seconds | None = None
    event: Literal["rest_taken"] = "rest_taken"


@dataclass(frozen=True, config=FACT_CONFIG)
class PauseTaken:
    """A pause has ended."""

    utc: UtcTime
    who: Literal["participant", "experimenter", "program"]
    """Who asked for the pause."""
    paused_s: Seconds
    monotonic_s: Seconds | None = None
    event: Literal["pause_taken"] = "pause_taken"


@dataclass(frozen=True, config=FACT_CONFIG)
class NoteTaken:
    """A note for the log, or a report of an adverse event."""

    utc: UtcTime
    who: Literal["participant", "experimenter", "program"]
    """Who wrote the note."""
    text: str
    adverse: bool = False
    """Whether the note reports an adverse event of the participant, such as pain, numbness or fright."""
    monotonic_s: Seconds | None = None
    event: Literal["note_taken"] = "note_taken"


@dataclass(frozen=True, config=FACT_CONFIG)
class SessionClosed:
    """Last event of a session: all runs were completed, or the person does not take part (consent refused,
    excluded)."""

    utc: UtcTime
    outcome: Literal["completed", "refused", "excluded"]
    """`refused`: consent was not given; `excluded`: by the exclusion questions."""
    monotonic_s: Seconds | None = None
    event: Literal["session_closed"] = "session_closed"
