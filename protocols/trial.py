"""One trial of a study as a row of results: what was presented, what was answered, what the device delivered."""

from dataclasses import dataclass
from enum import Enum


class Phase(Enum):
    """Kind of a trial or run."""

    TRAINING = "training"
    DETECTION = "detection"
    TEST = "test"
    CATCH = "catch"


class TrialStatus(Enum):
    """Outcome of one presentation."""

    OK = "ok"
    FLAGGED = "flagged"
    """Counts, but something about the stimulus is worth a look (a lean on the spring, late ticks)."""
    UNMEASURED = "unmeasured"
    """Counts; answered before a full period of the steady stimulus was recorded, or its recording was lost."""
    SPOILED = "spoiled"
    """Void: presented again as the next attempt of the same trial."""
    OPEN = "open"
    """Presented and not answered yet."""


class VoidCause(Enum):
    """Why a presentation is void and is repeated."""

    ASKED = "asked"
    """The participant asked for the same trial again."""
    PAUSED = "paused"
    """The participant asked for a pause."""
    LEFT = "left"
    """The participant left, or the program was interrupted at its keyboard."""
    LATE = "late"
    """No answer within the protocol's time limit."""
    EARLY = "early"
    """Answered before both intervals were over."""
    EXPERIMENTER = "experimenter"
    """The experimenter paused or stopped the session."""
    FAULT = "fault"
    """The device or its safety layer ended the stimulus."""
    MISSED_TICKS = "missed_ticks"
    """Too many ticks of the control loop were missed."""
    NO_ACCELERATION = "no_acceleration"
    """The protocol needs the accelerometer, and too much of what it sent was lost."""
    SCREEN_LATE = "screen_late"
    """The program or its screen gave no sign of life in time."""
    PROGRAM_ENDED = "program_ended"
    """The program ended before the answer."""


AT_WILL = frozenset({VoidCause.ASKED, VoidCause.PAUSED, VoidCause.LEFT, VoidCause.LATE, VoidCause.EARLY})
"""Causes that a participant can produce while feeling the stimulus."""


@dataclass(frozen=True, slots=True)
class Trial:
    """One presentation, one row of `trials.csv`. `None` where a value does not exist (yet)."""

    subject: str
    session: str
    run: int
    trial: int
    attempt: int
    phase: Phase
    frequency_hz: float
    level_n: float
    direction_shown: int
    answer: int | None
    correct: bool | None
    reversal: bool
    response_time_s: float | None
    """From the start of the stimulus, its fade-in included; in detection from the end of the second interval."""
    delivered_mps2: float | None
    off_axis_mps2: float | None
    displacement_mm: float | None
    missed_ticks: int | None
    felt: bool | None
    """False: a person answered while no device moved. None: a simulated participant."""
    status: TrialStatus
    angle_deg: float | None = None
    """Angle of the direction played, in the plane of the protocol's directions; independent of the labels."""
    wanted_mps2: float | None = None
    """The acceleration that the level stands for. None where the level is the commanded force."""
    void_cause: VoidCause | None = None
    """Why this presentation is void. None where it counts, is open, or comes from a log that says no cause."""
    repeat_cause: VoidCause | None = None
    """Why this trial is presented again: the cause of the attempt before. None for a first attempt."""
    late_ticks: int | None = None
    """Run, but their work ended after the next was due; missed ones come on top. 0 where the device is simulated: its
    world waits. None in a log of before they were written down."""
    latest_s: float | None = None
    """The longest from when a tick was due until its work, or that of the tick that came in its place, was done."""
    onset_s: float | None = None
    """When the presentation was logged, right before the device moved: seconds of the wall clock since the session was
    opened, breaks included."""
    harmonics_mps2: float | None = None
    """Amplitude of the acceleration at 2 to 5 times the frequency, all axes together. None where none was measured."""
    nominal_n: float | None = None
    """Level of the staircase, where `level_n`, which was played, was drawn around it. None where nothing is roved."""
    lost_packets: int | None = None
    """Lost packets of the accelerometer, torn or garbled ones among them. None, with the next two, where the sensor is
    read with each tick or there is none."""
    garbled_bytes: int | None = None
    """From the accelerometer, that belonged to no whole packet."""
    acceleration_missing: float | None = None
    """Share of its packets, or of the recorded ticks if that is more, without which the acceleration was measured."""

    @property
    def staircase_n(self) -> float:
        """Level of the staircase (N): without roving that of the stimulus."""
        return self.level_n if self.nominal_n is None else self.nominal_n

    @property
    def counts(self) -> bool:
        """Whether the answer moved the staircase."""
        return self.answer is not None and self.status is not TrialStatus.SPOILED
