"""Data classes that the participant's display shows, and the participant's replies to them.

No value reveals level, frequency or correctness of a single trial, so that the display cannot give hints. The module
is quick to import, because a screen shows its first frame before numerical libraries are loaded. `study.workflows`
makes the values; the displays (`study.tui`, simulated participants) show them and give the replies.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING, Literal

from protocols.trial import Phase, VoidCause

if TYPE_CHECKING:
    from protocols.definition.apparatus import TestDirections


class Task(Enum):
    """Question of a trial."""

    DIRECTION = "direction"
    """Along which of the two directions did the handle vibrate?"""
    INTERVAL = "interval"
    """In which of the two intervals did the handle vibrate?"""


@dataclass(frozen=True, slots=True)
class DirectionPicture:
    """Picture of the two directions as line segments in the plane of the test directions."""

    plane: str
    """xy, yz or zx."""
    angle_deg: tuple[float, float]
    """Angles of directions 1 and 2 as numbered for this participant (degrees), from the plane's first axis."""


@dataclass(frozen=True, slots=True)
class Welcome:
    """Information that a participant reads before the first trial."""

    title: str
    picture: DirectionPicture
    runs: int
    """Number of runs that are left in the session, without training and practice."""
    training_runs: int
    """Number of runs of training that are left, practice included."""
    device: str
    device_moves: bool
    """Whether a real device moves, so that the answers are not only practice; true for a simulated participant."""
    resumed_after: int
    """Number of answers from earlier sittings."""


@dataclass(frozen=True, slots=True)
class Progress:
    """Progress of the session, computed without stimulus levels, because these must not be revealed."""

    share_done: float
    """Fraction of the session done, 0 to 1."""
    minutes_left: int | None
    """Estimated minutes left, rounded up; None while there are too few answers for an estimate."""


@dataclass(frozen=True, slots=True)
class Question:
    """One trial as it is shown to the participant. A catch trial is shown like any other: its phase is TEST here."""

    phase: Phase
    """Phase of the run: training, detection or test."""
    run_number: int
    """Number of the run within its phase, from 1."""
    runs_in_phase: int
    """Number of runs of this phase."""
    trial_number: int
    """Number of the trial within the run, from 1."""
    repeated: bool
    """Whether the trial is presented again because its last presentation was void."""
    time_limit_s: float
    """Time limit for an answer (s), as the protocol sets it."""
    picture: DirectionPicture
    task: Task = Task.DIRECTION
    practice: bool = False
    """Whether the trial belongs to a short practice run with a criterion to pass."""
    progress: Progress | None = None
    repeats_left: int | None = None
    """Number of repetitions of trials that the participant may still request in this run; None: without limit (version
    1 of `study.session.state.rules`)."""


@dataclass(frozen=True, slots=True)
class PlayingNotice:
    """Notice while a stimulus, or an interval without stimulus, of fixed duration is played; no answer is taken."""

    title: str
    """Title of the interval, direction or probe, such as "Direction 1" or "Interval 2"; empty in the gap between two
    intervals."""
    number: int
    """Direction or interval that is highlighted, 1 or 2; 0: none."""
    seconds: float
    """Duration of the notice (s)."""
    picture: DirectionPicture | None
    """None where no direction is drawn (an interval, a probe)."""


@dataclass(frozen=True, slots=True)
class DemoMenu:
    """Menu of the labelled demonstration: each direction at each vibration (frequency), any number of times."""

    picture: DirectionPicture
    vibrations: int
    """Number of different vibrations; vibration 1 has the lowest frequency."""
    vibration: int
    """Number of the present vibration, from 1."""
    played_pairs: tuple[tuple[int, int], ...]
    """Pairs (vibration, direction number) that were already played."""
    handle_moves: bool
    """Whether a real handle moves; False with a simulated device, but true for a simulated participant."""


@dataclass(frozen=True, slots=True)
class PlayDemo:
    """Choice in the demonstration menu: direction `number` (1 or 2) at vibration `vibration` (from 1, the lowest
    frequency)."""

    vibration: int
    number: int


@dataclass(frozen=True, slots=True)
class DemoDone:
    """Choice of the participant to end the demonstration."""


DemoChoice = PlayDemo | DemoDone
"""The possible choices of a participant in the demonstration."""


@dataclass(frozen=True, slots=True)
class DeviceFinding:
    """One finding of a device check or of `hapteq doctor`, shown as a line."""

    name: str
    """What was checked."""
    value: str
    """Result in words, with units."""
    fine: bool
    """Whether the result meets its requirement."""
    advice: str = ""
    """Advice to the experimenter where the finding is not fine."""
    warning: bool = False
    """Whether a finding that is not fine is only a warning: the device may be used."""

    @property
    def wrong(self) -> bool:
        """Whether the finding prevents the use of the device: neither fine nor a warning."""
        return not self.fine and not self.warning

    @property
    def verdict(self) -> str:
        """Verdict in one word for a table: ok (fine), warn (a warning) or look (wrong)."""
        return "ok" if self.fine else "warn" if self.warning else "look"


@dataclass(frozen=True, slots=True)
class DeviceReport:
    """Findings of a device check. device: its name; simulated: whether it is simulated, so that no real handle
    moves."""

    device: str
    simulated: bool
    findings: tuple[DeviceFinding, ...]

    @property
    def fine(self) -> bool:
        """Whether all findings are fine, without any warning."""
        return all(finding.fine for finding in self.findings)

    @property
    def usable(self) -> bool:
        """Whether no finding is wrong; warnings are allowed."""
        return not any(finding.wrong for finding in self.findings)


@dataclass(frozen=True, slots=True)
class HandleView:
    """Position of the handle before a trial."""

    ready: bool
    """Whether the handle is near enough to the centre to start a trial."""
    sentence: str
    """Instruction, such as "Bring the handle 12 mm back to the centre"."""
    offset_mm: tuple[float, float]
    """Offset from the centre along the first and second axis of the plane; drawn to the right and up."""
    radius_mm: float
    """Radius around the centre within which a trial may start."""


@dataclass(frozen=True, slots=True)
class PracticeResult:
    """Result of a short practice run."""

    passed: bool
    """Whether its criterion was met."""
    correct_count: int
    answer_count: int
    """Number of latest answers among which `correct_count` were correct."""


@dataclass(frozen=True, slots=True)
class PauseNotice:
    """Notice to the participant during a pause."""

    reason: str
    """Origin or cause of the pause, as a text for the participant."""
    answers: int
    """Number of answers that are stored so far."""


class AfterPause(Enum):
    """The participant's decision that ends a pause."""

    CONTINUE_SITTING = "go_on"
    """Continue with the sitting."""
    END_SITTING = "leave"
    """End the sitting; the session can be resumed."""
    WITHDRAW = "withdraw"
    """Withdraw consent: end the sitting, and erase the data after the device is closed."""


@dataclass(frozen=True, slots=True)
class RestNotice:
    """Notice to the participant during an enforced rest: its duration (s), the number of runs left, the progress."""

    seconds: float
    runs_left: int
    progress: Progress | None = None


@dataclass(frozen=True, slots=True)
class Goodbye:
    """Last notice of a sitting. finished: whether the session is finished; answers: number of stored answers."""

    finished: bool
    answers: int
    reason: str = ""
    """Cause of an end before the session was finished; empty otherwise."""
    outcome: Literal["", "refused", "excluded"] = ""
    """Cause for which a person does not take part; the session is then closed. Empty for a participant."""


@dataclass(frozen=True, slots=True)
class Answered:
    """The participant's answer, 1 or 2: number of the direction or interval. Raises ValueError for other numbers."""

    answer: int
    key_time_s: float
    """Time at which the key arrived, by the session's monotonic clock (s)."""

    def __post_init__(self) -> None:
        if self.answer not in (1, 2):
            raise ValueError(f"an answer is 1 or 2, not {self.answer}")


@dataclass(frozen=True, slots=True)
class Unanswered:
    """Reply without an answer: the trial is void."""

    reason: str
    """Reason in words, as it is logged."""
    ends_sitting: bool
    """Whether the participant or the experimenter ends the sitting; the session can be resumed."""
    repeat_requested: bool = False
    """Whether the participant asked for a repetition of the trial; this shows that the participant is present."""
    pause: bool = False
    """Whether a pause was asked for: the force ends at once, and nothing is played until the session continues."""
    cause: VoidCause = VoidCause.FAULT
    """Cause of the void trial where `ends_sitting`, `repeat_requested` and `pause` are all false."""


Reply = Answered | Unanswered
"""Reply of a participant to a trial."""


def make_direction_picture(directions: TestDirections, labels_swapped: bool) -> DirectionPicture:
    """Make the picture of the two directions, at +45 and -45 degrees from the line of symmetry. labels_swapped: whether
    numbers 1 and 2 are exchanged for this participant."""
    first_angle_deg, second_angle_deg = directions.symmetry_deg + 45.0, directions.symmetry_deg - 45.0
    return DirectionPicture(
        directions.plane, (second_angle_deg, first_angle_deg) if labels_swapped else (first_angle_deg, second_angle_deg)
    )
