"""One presentation of a study as a row of results: stimulus, answer, and acceleration delivered by the device.

`Trial` is the row type of `trials.csv`, which `study.store.formats` writes and `analysis.psychophysics` reads; its
columns are listed in docs/formats.md. The unit of a number is the suffix of its name.
"""

from dataclasses import dataclass
from enum import Enum


class Phase(Enum):
    """Kind of a trial: training (practice included), detection, test, or catch trial within a test run."""

    TRAINING = "training"
    DETECTION = "detection"
    TEST = "test"
    CATCH = "catch"


class TrialStatus(Enum):
    """Outcome of one presentation."""

    OK = "ok"
    FLAGGED = "flagged"
    """Valid, but the stimulus should be inspected (for example a hand that leaned on the spring, or late ticks)."""
    UNMEASURED = "unmeasured"
    """Valid, but without a measurement: answered before a full period of the steady stimulus was recorded, or the
    recording was lost."""
    SPOILED = "spoiled"
    """Void: to be presented again as the next attempt of the same trial."""
    OPEN = "open"
    """Presented and not answered yet."""


class VoidCause(Enum):
    """Why a presentation is void and is repeated."""

    ASKED = "asked"
    """The participant asked for the same trial again."""
    PAUSED = "paused"
    """The participant asked for a pause."""
    LEFT = "left"
    """The participant ended the session, or the program was interrupted by Ctrl-C."""
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
    """The protocol requires the accelerometer, and too many of its samples were lost."""
    SCREEN_LATE = "screen_late"
    """The program or its screen did not respond in time."""
    PROGRAM_ENDED = "program_ended"
    """The program ended before the answer."""


PARTICIPANT_CAUSES = frozenset({VoidCause.ASKED, VoidCause.PAUSED, VoidCause.LEFT, VoidCause.LATE, VoidCause.EARLY})
"""Causes that a participant can bring about deliberately after feeling the stimulus, which could bias the results: the
analysis counts them."""


@dataclass(frozen=True, slots=True)
class Trial:
    """One presentation, one row of `trials.csv`. None: the value does not exist, or not yet. Runs of a session, trials
    of a run and attempts of a trial are numbered from 0. Amplitudes are peak values."""

    subject: str
    session: str
    run: int
    trial: int
    attempt: int
    phase: Phase
    frequency_hz: float
    level_n: float
    """Commanded amplitude of the stimulus (N)."""
    direction_shown: int
    """Number on the screen, 1 or 2, of the direction; in detection of the interval with the stimulus."""
    answer: int | None
    """Number that the participant answered, 1 or 2."""
    correct: bool | None
    """Whether answer and direction_shown are equal."""
    reversal: bool
    """Whether the answer made a reversal of the staircase."""
    response_time_s: float | None
    """Response time (s) from the start of the stimulus, its fade-in included; in detection from the end of the second
    interval."""
    delivered_mps2: float | None
    """Amplitude of the acceleration along the played direction, at the stimulus frequency."""
    off_axis_mps2: float | None
    """Amplitude of the acceleration across that direction, at the stimulus frequency."""
    displacement_mm: float | None
    """Amplitude of the displacement along the direction: delivered acceleration over (2 pi f)²."""
    missed_ticks: int | None
    """Number of ticks of the control loop that were not run in time."""
    felt: bool | None
    """True: a device moved the participant's hand. False: a person answered while no device moved. None: a simulated
    participant."""
    status: TrialStatus
    angle_deg: float | None = None
    """Angle of the direction played (degrees), in the plane of the protocol's directions; independent of the labels."""
    wanted_mps2: float | None = None
    """Target acceleration of this level (m/s²). None where the level is the commanded force."""
    void_cause: VoidCause | None = None
    """Why this presentation is void. None where it counts, is open, or its log contains no cause."""
    repeat_cause: VoidCause | None = None
    """Why this trial is repeated: the cause for which the previous attempt is void. None for a first attempt."""
    late_ticks: int | None = None
    """Number of ticks that were run but ended after the next tick was due; missed ticks are counted separately. 0 for a
    simulated device, whose time waits for the program. None in logs older than this column."""
    latest_s: float | None = None
    """Longest time (s) from when a tick was due to the end of its work; for a missed tick, to the end of the tick that
    was run in its place."""
    onset_s: float | None = None
    """Time (s) at which the presentation was logged, directly before the device moved: wall-clock time since the
    session was opened, breaks included."""
    harmonics_mps2: float | None = None
    """Amplitude of the acceleration (m/s²) at 2 to 5 times the frequency, all axes together. None where it was not
    measured."""
    nominal_n: float | None = None
    """Level of the staircase (N), around which the played `level_n` was drawn. None without roving."""
    lost_packets: int | None = None
    """Lost packets of the accelerometer, including incomplete and corrupt ones. None, like the next two fields, where
    the sensor is read with each tick or there is none."""
    garbled_bytes: int | None = None
    """Bytes from the accelerometer that belonged to no complete packet."""
    acceleration_missing: float | None = None
    """Missing share (0 to 1) of the accelerometer's data: of its packets or of the recorded ticks, the larger one."""

    @property
    def staircase_n(self) -> float:
        """Level of the staircase (N); without roving it is the level of the stimulus."""
        return self.level_n if self.nominal_n is None else self.nominal_n

    @property
    def is_valid(self) -> bool:
        """Whether the answer is valid: given, and the presentation is not void. Catch trials are included."""
        return self.answer is not None and self.status is not TrialStatus.SPOILED
