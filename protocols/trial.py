"""The rows that everybody talks about: what was shown, what was said, what the device really did."""

from dataclasses import dataclass
from enum import Enum


class Phase(Enum):
    TRAINING = "training"
    DETECTION = "detection"
    TEST = "test"
    CATCH = "catch"


class TrialStatus(Enum):
    """What became of one presentation."""

    OK = "ok"
    FLAGGED = "flagged"
    """Counts, but something about the stimulus is worth a look (a lean on the spring, late ticks)."""
    UNMEASURED = "unmeasured"
    """Counts; its recording was lost (the program died after the answer was on disk)."""
    SPOILED = "spoiled"
    """Void: drawn again as the next attempt of the same trial."""
    OPEN = "open"
    """Presented and not answered yet."""


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
    delivered_mps2: float | None
    off_axis_mps2: float | None
    displacement_mm: float | None
    missed_ticks: int | None
    felt: bool | None
    """False: a person answered while no device moved. None: a simulated participant."""
    status: TrialStatus
    angle_deg: float | None = None
    """Of the direction played, in the plane of the protocol's directions; does not depend on how they are labelled."""
    wanted_mps2: float | None = None
    """The acceleration that the level stands for. None where the level is the commanded force."""

    @property
    def counts(self) -> bool:
        """Whether the answer moved the staircase."""
        return self.answer is not None and self.status is not TrialStatus.SPOILED
