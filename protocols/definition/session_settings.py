"""Session settings of a study protocol: detection runs, catch trials, start condition of a trial, limits of a sitting.

Each class is a table of the TOML file; Pydantic checks its values. Part of `study_protocol`.
"""

from typing import Annotated, Self

from pydantic import Field, model_validator
from pydantic.dataclasses import dataclass

from protocols.definition.field_types import MAX_AMPLITUDE_N, StimulusFrequency
from protocols.definition.problem import Problem, refuse
from protocols.definition.staircase_rule import STRICT


@dataclass(frozen=True, config=STRICT)
class DetectionSettings:
    """Detection runs: two-interval forced choice of the interval that contains the vibration.

    They follow the up-down rule of the study, from another start level.
    """

    frequencies_hz: tuple[StimulusFrequency, ...] = Field(
        default=(),
        max_length=20,
        description="One detection run for each frequency, after the test runs, in this order. Default: none.",
    )
    start_n: float = Field(
        default=0.5,
        ge=0.001,
        le=MAX_AMPLITUDE_N,
        description="Level of the first trial. Default 0.5: felt by most hands.",
    )
    interval_s: float = Field(
        default=1.5,
        ge=0.3,
        le=10,
        description="Length of each interval, fades included. Default 1.5: the fades and one second.",
    )
    gap_s: Annotated[float, Field(ge=0.1, le=10, description="Pause between the two intervals. Default 0.5.")] = 0.5
    trial_limit: int = Field(
        default=0,
        ge=0,
        le=1000,
        description="A run ends after this number of trials at the latest. Default 0: a complete staircase.",
    )


@dataclass(frozen=True, config=STRICT)
class CatchSettings:
    """Catch trials: trials at the cap, mixed into the test runs, whose wrong answers are lapses. They do not move the
    staircase."""

    one_in: int = Field(
        default=0,
        ge=0,
        le=100,
        description="One in this many trials is a catch trial, at a random position. Default 0: none, as "
        "published. A value of 20 adds 5 % more trials.",
    )

    @model_validator(mode="after")
    def _require_rare_trials(self) -> Self:
        """Raise InconsistentError for one_in of 1 to 3: at most a quarter of the trials may be catch trials."""
        if self.one_in and self.one_in < 4:
            refuse([Problem("one_in", f"is {self.one_in}", "0 for none, or at least 4: catch trials must stay rare")])
        return self


@dataclass(frozen=True, config=STRICT)
class GateSettings:
    """Start condition of a trial: the handle must have been near its place for some time."""

    radius_mm: float = Field(
        default=0.0,
        ge=0,
        le=50,
        description="Largest distance of the handle from its place at the start of a trial. Default 0: no gate.",
    )
    still_s: float = Field(
        default=0.3,
        ge=0,
        le=5,
        description="Time for which the handle must have been within the radius. Default 0.3: a handle that only "
        "passes through does not start a trial.",
    )


@dataclass(frozen=True, config=STRICT)
class SittingLimits:
    """Limits of duration and vibration exposure of one sitting of a person. At a limit the sitting ends between two
    trials; it continues on another day."""

    longest_min: float = Field(
        default=120.0, gt=0, le=480, description="Time from the first trial or demonstration. Default 120 minutes."
    )
    dose_a8_mps2: float = Field(
        default=2.5,
        gt=0,
        le=5.0,
        description="Vibration exposure A(8) after ISO 5349-1. Default 2.5, the daily exposure action value of "
        "directive 2002/44/EC; its limit value is 5.",
    )
