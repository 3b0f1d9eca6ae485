"""What a person who watches a running session may see. Values only, light to import, without a seed.

The direction of a trial is not in here before its answer is in: an experimenter who knows it can give it away.
Numbers of runs, trials and attempts count from 0, as in the files; a screen that shows them adds one.
"""

from dataclasses import dataclass
from typing import Literal

from study.session.watching.live import Live

Standing = Literal["running", "paused", "resting", "not running", "finished", "stopped", "refused", "excluded"]
"""`stopped`: the sitting was ended; `not running`: the program ended without writing so. Both can be resumed."""

ON: tuple[Standing, ...] = ("running", "paused", "resting")
"""Standings of a session whose program runs."""

RunStatus = Literal["done", "present", "to come"]
"""State of a run within the schedule."""


@dataclass(frozen=True, slots=True)
class WatchedRun:
    """A run of the session's schedule and its progress, in counted trials and reversals."""

    run: int
    phase: str
    """training, practice, test or detection."""
    frequency_hz: float
    status: RunStatus
    reversals: int
    reversals_needed: int
    """0 for a practice run, which has none."""
    trials: int
    """Counted ones."""


@dataclass(frozen=True, slots=True)
class StaircasePoint:
    """A counted trial that steers the run; catch trials do not steer it."""

    trial: int
    level_n: float
    correct: bool
    reversal: bool


@dataclass(frozen=True, slots=True)
class OpenTrial:
    """Presented, its answer not in."""

    run: int
    trial: int
    attempt: int
    frequency_hz: float
    level_n: float
    catch: bool
    presented_s: float
    """Seconds since."""


@dataclass(frozen=True, slots=True)
class ClosedTrial:
    """A trial that was answered or is void. `shown` and `correct` are None for a void trial, and while it is
    measured."""

    run: int
    trial: int
    attempt: int
    phase: str
    frequency_hz: float
    level_n: float
    shown: int | None
    """1 or 2: the direction, in a detection run the interval. None where no answer ever came."""
    answer: int | None
    correct: bool | None
    reversal: bool
    response_time_s: float | None
    delivered_mps2: float | None
    off_axis_mps2: float | None
    status: str
    """ok, flagged, unmeasured, spoiled; or measuring, while what the device did is not in the log."""
    remark: str
    """Flags, or why it is void."""


@dataclass(frozen=True, slots=True)
class Exposure:
    """What the participant got in this sitting, and how much is allowed."""

    elapsed_min: float
    limit_min: float
    dose_a8_mps2: float
    dose_limit_mps2: float

    @property
    def time_share(self) -> float:
        """Elapsed time over its limit; above 1 beyond it."""
        return self.elapsed_min / self.limit_min

    @property
    def dose_share(self) -> float:
        """A(8) over its limit; above 1 beyond it."""
        return self.dose_a8_mps2 / self.dose_limit_mps2


@dataclass(frozen=True, slots=True)
class PracticeLine:
    """Result of a practice run: `right` of the last `of` answers were correct; passed: its criterion was met."""

    frequency_hz: float
    right: int
    of: int
    passed: bool


@dataclass(frozen=True, slots=True)
class FormLine:
    """A form that was filled in, without its answers. passed: False where consent was not given or the person may not
    take part."""

    utc: str
    form: str
    passed: bool


@dataclass(frozen=True, slots=True)
class NoteLine:
    """A note of the session's log. who: participant, experimenter or program; adverse: about an adverse event, such as
    pain."""

    utc: str
    who: str
    text: str
    adverse: bool


@dataclass(frozen=True, slots=True)
class DriftLine:
    """Something that the probes of the session found changed."""

    since_s: float
    """Since the session was opened, when it was first seen."""
    sentence: str
    beyond: bool
    """Whether the drift exceeds what the analysis of the session allows."""


@dataclass(frozen=True, slots=True)
class Alarm:
    """An alert for the experimenter: a state that lasts, or a single event of the followed session."""

    kind: str
    sentence: str
    """What is wrong, and what to do."""
    since: str
    """UTC. The same alarm keeps its time as long as it lasts."""
    urgent: bool = True
    """Rings until it was seen; others ring once."""
    event: bool = False
    """Something that happened, each time anew; others are states that come and go."""


@dataclass(frozen=True, slots=True)
class WatchView:
    """The complete view of a followed session at a moment, from which screens and lines for watchers are made."""

    utc: str
    """When this was true."""
    session: str
    subject: str
    protocol: str
    """Title of the protocol."""
    device: str
    simulated: bool
    """Nothing moves."""
    observer: str | None
    """Name of the simulated participant; None for a person."""
    standing: Standing
    reason: str
    """Why it does not run; empty while it runs."""
    activity: str
    """In words."""
    activity_s: float
    """For how long."""
    runs: tuple[WatchedRun, ...]
    shown_run: int | None
    """The run that `points` belong to: the present one, or the last one while nothing is answered in it."""
    points: tuple[StaircasePoint, ...]
    next_level_n: float | None
    """Next level of the staircase in `shown_run`, after the last point; None where the run is over."""
    cap_n: float
    open_trial: OpenTrial | None
    last: tuple[ClosedTrial, ...]
    """Newest first."""
    answers: int
    exposure: Exposure
    catch_given: int
    catch_lapses: int
    practice: tuple[PracticeLine, ...]
    forms: tuple[FormLine, ...]
    notes: tuple[NoteLine, ...]
    """Newest first."""
    gate_radius_mm: float
    """0 where there is no gate."""
    live: Live | None
    """Live values; None where nothing was received for some seconds."""
    alarms: tuple[Alarm, ...]
    probes: int = 0
    """Kept so far, references included."""
    drifts: tuple[DriftLine, ...] = ()

    @property
    def present_run(self) -> WatchedRun | None:
        """The run that is under way, or would be next; None after the last."""
        return next((run for run in self.runs if run.status == "present"), None)
