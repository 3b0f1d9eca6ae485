"""Data classes of the view that an experimenter has of a running session; field names are the keys of its JSON form.

The view contains no seed, and the direction of a trial only once its answer counts, because an experimenter who knows
the direction could reveal it to the participant. Runs, trials and attempts are numbered from 0, as in the files; a
screen adds 1. Levels are stimulus amplitudes, stated as force (N). The values are plain, so that the module imports
quickly.
"""

from dataclasses import dataclass
from typing import Literal

from study.session.watching.live_state import LiveState

SittingStatus = Literal["running", "paused", "resting", "not running", "finished", "stopped", "refused", "excluded"]
"""Status of a session. `stopped`: the sitting was ended; `not running`: the program ended without logging the end. Both
can be resumed. `refused`, `excluded`: the person does not take part."""

RUNNING_STATUSES: tuple[SittingStatus, ...] = ("running", "paused", "resting")
"""The statuses in which the program of the session runs."""

RunStatus = Literal["done", "present", "to come"]
"""State of a run within the schedule."""


@dataclass(frozen=True, slots=True)
class WatchedRun:
    """A run of the session's schedule and its progress, in counted trials and reversals."""

    run: int
    """Index of the run in the schedule."""
    phase: str
    """Training, practice, test or detection."""
    frequency_hz: float
    """Frequency of the stimulus (Hz)."""
    status: RunStatus
    """Whether the run is done, in progress or next, or later."""
    reversals: int
    """Number of reversals so far."""
    reversals_needed: int
    """Number of reversals that end the run; 0 where the run ends by another rule (practice, Bayesian placement)."""
    trials: int
    """Number of trials that count."""


@dataclass(frozen=True, slots=True)
class StaircasePoint:
    """A counted trial of a staircase; catch trials, which do not affect the staircase, are left out."""

    trial: int
    """Index of the trial in its run."""
    level_n: float
    """Level of the staircase (N), before roving."""
    correct: bool
    reversal: bool
    """Whether the staircase reversed its direction at this trial."""


@dataclass(frozen=True, slots=True)
class OpenTrial:
    """A trial that is presented and not answered yet. run, trial, attempt: indices of the run, of the trial in the run,
    and of its presentation; catch: whether it is a catch trial."""

    run: int
    trial: int
    attempt: int
    frequency_hz: float
    level_n: float
    catch: bool
    presented_s: float
    """Time since the presentation (s)."""


@dataclass(frozen=True, slots=True)
class ClosedTrial:
    """A trial that was answered or is void, with its indices as in `OpenTrial`. `shown` and `correct` are None for a
    void trial, and until it is decided whether the trial counts."""

    run: int
    trial: int
    attempt: int
    phase: str
    """Training, practice, test, detection or catch."""
    frequency_hz: float
    level_n: float
    shown: int | None
    """Correct answer, 1 or 2: number of the direction or, in a detection run, of the interval."""
    answer: int | None
    """Answer of the participant, 1 or 2; None where there is none."""
    correct: bool | None
    reversal: bool
    """Whether the staircase reversed its direction at this trial."""
    response_time_s: float | None
    """Time from the onset to the answer (s); None where there is none."""
    delivered_mps2: float | None
    """Measured amplitude of the acceleration along the direction (m/s²); None where it was not measured."""
    off_axis_mps2: float | None
    """Measured amplitude of the acceleration across the direction (m/s²); None where it was not measured."""
    status: str
    """ok, flagged, unmeasured or spoiled (`TrialStatus`); measuring while the measurement is not in the log."""
    remark: str
    """Flags, or the reason why the trial is void."""


@dataclass(frozen=True, slots=True)
class Exposure:
    """Duration of the sitting (min) and vibration dose of the hand (m/s²), with their limits."""

    elapsed_min: float
    """Time since the handle first moved in the sitting (min); 0 before."""
    limit_min: float
    """Longest sitting of the protocol (min)."""
    dose_a8_mps2: float
    """Daily vibration exposure A(8) by ISO 5349-1, as in `vibration_dose`."""
    dose_limit_mps2: float
    """Largest A(8) of the protocol (m/s²)."""

    @property
    def time_share(self) -> float:
        """Elapsed time as a fraction of its limit."""
        return self.elapsed_min / self.limit_min

    @property
    def dose_share(self) -> float:
        """A(8) as a fraction of its limit."""
        return self.dose_a8_mps2 / self.dose_limit_mps2


@dataclass(frozen=True, slots=True)
class PracticeResult:
    """Result of a practice run at this frequency (Hz): `right` of the last `of` answers were correct. passed: whether
    the criterion was met."""

    frequency_hz: float
    right: int
    of: int
    passed: bool


@dataclass(frozen=True, slots=True)
class FormRecord:
    """A form that was filled in, without its answers. passed: False where consent was not given or the person may not
    take part."""

    utc: str
    """Time at which it was filled in (UTC, ISO 8601)."""
    form: str
    """Kind of the form (`FormKind`)."""
    passed: bool


@dataclass(frozen=True, slots=True)
class NoteRecord:
    """A note of the session's log. who: participant, experimenter or program; adverse: about an adverse event, such as
    pain."""

    utc: str
    """Time of the note (UTC, ISO 8601)."""
    who: str
    text: str
    adverse: bool


@dataclass(frozen=True, slots=True)
class DriftRecord:
    """A drift (change of the device or of the grip during the session) that its probes show."""

    since_s: float
    """Time from the opening of the session to the first probe with this change (s)."""
    sentence: str
    """The drift in words, with its unit and time."""
    beyond: bool
    """Whether the drift exceeds its limit in `session_drift.MAX_CHANGES`."""


@dataclass(frozen=True, slots=True)
class Alarm:
    """An alarm for the experimenter: a lasting state, or a single event, of the followed session."""

    kind: str
    """Short name that identifies the alarm, such as "device"."""
    sentence: str
    """Cause and remedy, for the experimenter."""
    since: str
    """Start time, UTC (ISO 8601). An alarm keeps its start time as long as it lasts."""
    urgent: bool = True
    """Whether the alarm sounds until the experimenter has seen it; other alarms sound once."""
    event: bool = False
    """Whether the alarm is a single event, which is new each time it happens; other alarms are states that last."""


@dataclass(frozen=True, slots=True)
class WatchView:
    """The complete view of a followed session at one moment, from which screens and text lines are made."""

    utc: str
    """Time of the view (UTC, ISO 8601)."""
    session: str
    subject: str
    """Code of the participant."""
    protocol: str
    """Title of the protocol."""
    device: str
    simulated: bool
    """Whether the device is simulated, so that no real handle moves."""
    observer: str | None
    """Name of the simulated participant; None for a person."""
    standing: SittingStatus
    reason: str
    """Reason why the session does not run, in words; empty while it runs."""
    activity: str
    """Present activity in words."""
    activity_s: float
    """Duration of this activity so far (s)."""
    runs: tuple[WatchedRun, ...]
    """All runs of the schedule, in order."""
    shown_run: int | None
    """Index of the run that `points` belong to, see `followed_trials.find_shown_run`."""
    points: tuple[StaircasePoint, ...]
    """Counted trials of `shown_run` without catch trials, in order."""
    next_level_n: float | None
    """Next level (N) in `shown_run`, after the last point, as `followed_trials.find_next_level_n` gives it; None where
    the run is over."""
    cap_n: float
    """Highest level of the staircase (N)."""
    open_trial: OpenTrial | None
    """Trial that waits for its answer; None if there is none."""
    last: tuple[ClosedTrial, ...]
    """Latest closed trials, newest first."""
    answers: int
    """Number of answers that count."""
    exposure: Exposure
    """Duration of the sitting and vibration dose, with their limits."""
    catch_given: int
    """Number of catch trials that count."""
    catch_lapses: int
    """Number of wrong answers to catch trials."""
    practice: tuple[PracticeResult, ...]
    """Results of the completed practice runs."""
    forms: tuple[FormRecord, ...]
    """Forms filled in so far, oldest first."""
    notes: tuple[NoteRecord, ...]
    """Notes of the log, newest first."""
    gate_radius_mm: float
    """Radius (mm) within which the handle must be for a trial to start; 0 without a gate."""
    live: LiveState | None
    """Live state; None where it is out of date or the program does not run."""
    alarms: tuple[Alarm, ...]
    """Present alarms."""
    probes: int = 0
    """Number of probes with a recording that can be used, references included."""
    drifts: tuple[DriftRecord, ...] = ()
    """Drifts that the probes show at present."""

    @property
    def present_run(self) -> WatchedRun | None:
        """The run in progress, or the next run; None after the last run."""
        return next((run for run in self.runs if run.status == "present"), None)
