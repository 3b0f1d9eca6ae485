"""What a display may know. Nothing here gives away level, frequency or correctness."""

from dataclasses import dataclass

from protocols.apparatus import TestDirections
from protocols.trial import Phase


@dataclass(frozen=True, slots=True)
class DirectionPicture:
    """The two directions as oriented segments: angle of each number in the plane, from its first axis."""

    plane: str
    angle_deg: tuple[float, float]
    """Of number 1 and number 2, as this participant sees them."""


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
class Question:
    """One trial as the participant sees it."""

    phase: Phase
    run_number: int
    """From 1, within its phase."""
    runs_in_phase: int
    trial_number: int
    """From 1, within the run."""
    repeated: bool
    """Drawn again because the last presentation was void."""
    time_limit_s: float


@dataclass(frozen=True, slots=True)
class RestNotice:
    seconds: float
    runs_left: int


@dataclass(frozen=True, slots=True)
class Goodbye:
    finished: bool
    answers: int


@dataclass(frozen=True, slots=True)
class Answered:
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


Reply = Answered | Unanswered


def picture_of(directions: TestDirections, swapped: bool) -> DirectionPicture:
    first, second = directions.symmetry_deg + 45.0, directions.symmetry_deg - 45.0
    return DirectionPicture(directions.plane, (second, first) if swapped else (first, second))
