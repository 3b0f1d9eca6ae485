"""Trials beside the staircase, where the handle must be, and how much of all this a hand may get in a sitting."""

from typing import Annotated, Self

from pydantic import Field, model_validator
from pydantic.dataclasses import dataclass

from protocols.definition.field_types import StimulusFrequency
from protocols.definition.problem import Problem, refuse
from protocols.definition.staircase_rule import STRICT


@dataclass(frozen=True, config=STRICT)
class DetectionSettings:
    """Is the vibration felt at all? One of two intervals holds a stimulus; which one is asked.

    The same up-down rule as the study's, from a level of its own.
    """

    frequencies_hz: Annotated[
        tuple[StimulusFrequency, ...],
        Field(max_length=20, description="One detection run each, after the test runs, in this order. Default: none."),
    ] = ()
    start_n: Annotated[
        float, Field(ge=0.001, le=3.0, description="Level of the first trial. Default 0.5: felt by most hands.")
    ] = 0.5
    interval_s: Annotated[
        float,
        Field(ge=0.3, le=10, description="Length of each interval, fades included. Default 1.5: fades, and a second."),
    ] = 1.5
    gap_s: Annotated[float, Field(ge=0.1, le=10, description="Stillness between the two. Default 0.5.")] = 0.5
    trial_limit: Annotated[
        int,
        Field(
            ge=0,
            le=1000,
            description="A run ends after this number of trials at the latest. Default 0: a complete staircase.",
        ),
    ] = 0


@dataclass(frozen=True, config=STRICT)
class CatchSettings:
    """Trials at full level (the cap), mixed into the test runs. They steer nothing; errors in them are lapses."""

    one_in: Annotated[
        int,
        Field(
            ge=0,
            le=100,
            description="One in this many trials is a catch trial, at a random position. Default 0: none, as "
            "published. 20 costs 5 % more trials.",
        ),
    ] = 0

    @model_validator(mode="after")
    def _rare(self) -> Self:
        if self.one_in and self.one_in < 4:
            refuse([Problem("one_in", f"is {self.one_in}", "0 for none, or at least 4: catch trials must stay rare")])
        return self


@dataclass(frozen=True, config=STRICT)
class GateSettings:
    """A trial starts only with the handle near its place."""

    radius_mm: Annotated[
        float,
        Field(ge=0, le=50, description="Farthest the handle may be from its place at the start. Default 0: no gate."),
    ] = 0.0
    still_s: Annotated[
        float, Field(ge=0, le=5, description="How long it must have been there. Default 0.3: not just passing.")
    ] = 0.3


@dataclass(frozen=True, config=STRICT)
class SittingLimits:
    """Hard limits of one sitting of a person. Where one is reached, it ends between two trials; another day goes on."""

    longest_min: Annotated[
        float, Field(gt=0, le=480, description="From the first trial or demonstration. Default 120 minutes.")
    ] = 120.0
    dose_a8_mps2: Annotated[
        float,
        Field(
            gt=0,
            le=5.0,
            description="Vibration exposure A(8) after ISO 5349-1. Default 2.5, the daily exposure action value of "
            "directive 2002/44/EC; its limit value is 5.",
        ),
    ] = 2.5
