"""Values for the participant's display. None of them reveals level, frequency or correctness.

Values only, and light to import: a screen shows its first frame before anything heavy is loaded.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING, Literal

from protocols.trial import Phase, VoidCause

if TYPE_CHECKING:
    from protocols.definition.apparatus import TestDirections


class Task(Enum):
    """What a trial asks."""

    DIRECTION = "direction"
    """Along which of the two directions did it shake?"""
    INTERVAL = "interval"
    """In which of the two intervals did it shake at all?"""


@dataclass(frozen=True, slots=True)
class DirectionPicture:
    """The two directions as oriented segments: angle of each number in the plane, from its first axis."""

    plane: str
    angle_deg: tuple[float, float]
    """Angles of directions 1 and 2, as this participant sees them."""


@dataclass(frozen=True, slots=True)
class Welcome:
    """What a participant reads before the first trial."""

    title: str
    picture: DirectionPicture
    runs: int
    training_runs: int
    device: str
    felt: bool
    """False where no device moves: the answers are practice."""
    resumed_after: int
    """Answers already on disk."""


@dataclass(frozen=True, slots=True)
class Progress:
    """How far the session is. Made from runs and counted trials, never from levels."""

    share_done: float
    """0 to 1."""
    minutes_left: int | None
    """Rounded up; None until there is a trial to estimate it from."""


@dataclass(frozen=True, slots=True)
class Question:
    """One trial as the participant sees it. A catch trial looks like any other: its phase says TEST."""

    phase: Phase
    run_number: int
    """From 1, within its phase."""
    runs_in_phase: int
    trial_number: int
    """From 1, within the run."""
    repeated: bool
    """Presented again because the last presentation was void."""
    time_limit_s: float
    picture: DirectionPicture
    task: Task = Task.DIRECTION
    practice: bool = False
    """A short practice, with a criterion to pass."""
    progress: Progress | None = None
    repeats_left: int | None = None
    """How often the participant may still ask for a trial of this run again. None: no limit (first rules)."""


@dataclass(frozen=True, slots=True)
class PlayingNotice:
    """A stimulus (or its absence) of a fixed length, to which nothing is answered yet."""

    title: str
    """Title of the interval or direction, such as "Direction 1" or "Interval 2"."""
    number: int
    """1 or 2: what is highlighted."""
    seconds: float
    picture: DirectionPicture | None
    """None where there is nothing to draw (an interval)."""


@dataclass(frozen=True, slots=True)
class DemoMenu:
    """The labelled demonstration: each direction at each vibration, as often as wanted."""

    picture: DirectionPicture
    vibrations: int
    """How many; number 1 is the slowest."""
    vibration: int
    """The present one, from 1."""
    felt: tuple[tuple[int, int], ...]
    """(vibration, direction number) already played."""
    handle_moves: bool
    """False with a simulated device."""


@dataclass(frozen=True, slots=True)
class PlayDemo:
    """Choice in the demonstration menu: direction `number` (1 or 2) at vibration `vibration` (from 1, the slowest)."""

    vibration: int
    number: int


@dataclass(frozen=True, slots=True)
class DemoDone:
    """Enough was felt."""


DemoChoice = PlayDemo | DemoDone
"""What a participant can choose in the demonstration."""


@dataclass(frozen=True, slots=True)
class DeviceFinding:
    """One line of the device check."""

    name: str
    value: str
    fine: bool
    advice: str = ""
    """What to do where it is not fine."""
    warning: bool = False
    """Not fine, but no obstacle to anything that this device is used for."""

    @property
    def wrong(self) -> bool:
        """Whether it hinders the study: not fine, and no mere warning."""
        return not self.fine and not self.warning

    @property
    def verdict(self) -> str:
        """ok, warn (a warning) or look (wrong), for a column."""
        return "ok" if self.fine else "warn" if self.warning else "look"


@dataclass(frozen=True, slots=True)
class DeviceReport:
    """Findings of a device check; simulated: nothing moves."""

    device: str
    simulated: bool
    findings: tuple[DeviceFinding, ...]

    @property
    def fine(self) -> bool:
        """Whether all findings are fine; False with a mere warning too."""
        return all(finding.fine for finding in self.findings)

    @property
    def usable(self) -> bool:
        """Warnings aside, nothing is wrong."""
        return not any(finding.wrong for finding in self.findings)


@dataclass(frozen=True, slots=True)
class HandleView:
    """Whether the handle is where a trial may start."""

    ready: bool
    sentence: str
    """Instruction, such as "Bring the handle 12 mm back to the centre"."""
    offset_mm: tuple[float, float]
    """From the centre, right and up in the plane of the picture."""
    radius_mm: float


@dataclass(frozen=True, slots=True)
class PracticeResult:
    """Result of a short practice."""

    passed: bool
    right: int
    of: int
    """Number of last answers of which the right ones are counted."""


@dataclass(frozen=True, slots=True)
class PauseNotice:
    """What the participant sees during a pause."""

    reason: str
    """Who asked, or what happened: shown to the participant."""
    answers: int
    """On disk."""


class AfterPause(Enum):
    """The participant's decision that ends a pause."""

    GO_ON = "go_on"
    LEAVE = "leave"
    """The session can be resumed."""
    WITHDRAW = "withdraw"
    """The participant withdraws the consent: leave, and erase after the device is closed."""


@dataclass(frozen=True, slots=True)
class RestNotice:
    """What the participant sees during an enforced rest: its length, the runs left, and the progress."""

    seconds: float
    runs_left: int
    progress: Progress | None = None


@dataclass(frozen=True, slots=True)
class Goodbye:
    """Last notice of a sitting. finished: the whole session, not only this sitting."""

    finished: bool
    answers: int
    reason: str = ""
    """Why the sitting ended before the session was finished."""
    outcome: Literal["", "refused", "excluded"] = ""
    """Why a person does not take part: then there is no session to continue."""


@dataclass(frozen=True, slots=True)
class Answered:
    """The participant's answer, 1 or 2: number of the direction or interval. Raises ValueError for other numbers."""

    answer: int
    at_s: float
    """Clock time at which the key arrived."""

    def __post_init__(self) -> None:
        if self.answer not in (1, 2):
            raise ValueError(f"an answer is 1 or 2, not {self.answer}")


@dataclass(frozen=True, slots=True)
class Unanswered:
    """No answer: the trial is void."""

    reason: str
    leave: bool
    """The participant or experimenter ends the sitting; it can be resumed."""
    asked: bool = False
    """The participant asked for the trial again, and so is there."""
    pause: bool = False
    """Asked for a pause: hands free at once, and nothing is played until it goes on."""
    cause: VoidCause = VoidCause.FAULT
    """Why no answer came, where `leave`, `asked` and `pause` do not tell."""


Reply = Answered | Unanswered
"""Reply of a participant to a trial."""


def picture_of(directions: TestDirections, swapped: bool) -> DirectionPicture:
    """Picture of the two directions, 45 degrees to either side of the symmetry axis. swapped: numbers 1 and 2 are
    exchanged."""
    first, second = directions.symmetry_deg + 45.0, directions.symmetry_deg - 45.0
    return DirectionPicture(directions.plane, (second, first) if swapped else (first, second))
