"""The numbers and choices of a staircase, as a protocol file states them."""

from enum import Enum
from typing import Annotated, Literal, Self

from pydantic import ConfigDict, Field, model_validator
from pydantic.dataclasses import dataclass

from protocols.definition.problem import Problem, refuse

STRICT = ConfigDict(extra="forbid", allow_inf_nan=False)


class StepChange(Enum):
    """When the next step size of the schedule comes into force.

    Published "4 dB, then 1 dB" staircases differ here, and the threshold with them (0.7 to 1.1 dB).
    """

    AFTER_REVERSAL = "after_reversal"
    """The completing reversal still uses the old step; every later movement uses the new one."""
    AT_REVERSAL = "at_reversal"
    """The completing reversal itself already uses the new step."""
    AT_NEXT_REVERSAL = "at_next_reversal"
    """The old step stays until one reversal more has happened."""


@dataclass(frozen=True, config=STRICT)
class StepPhase:
    """A step size, and the number of reversals for which it holds."""

    step_db: Annotated[float, Field(gt=0, le=20, description="Size of one movement, in dB.")]
    reversals: Annotated[int, Field(ge=1, le=100, description="How many reversals belong to this phase.")]


@dataclass(frozen=True, config=STRICT)
class BayesianPlacement:
    """Levels by the Psi method in place of the up-down rule, which `protocols.procedure.psi` describes."""

    trials: Annotated[
        int,
        Field(
            ge=0,
            le=500,
            description="Trials of a run whose levels are chosen by Psi, from the cap downwards in steps of 1 dB; 0: "
            "by the up-down rule. The first trial is at start_n in either case. Default: 0, as published.",
        ),
    ] = 0
    spread_db: Annotated[
        float,
        Field(
            ge=0,
            le=20,
            description="End a run earlier, once the standard deviation of its threshold's posterior is this small, in "
            "dB. Default: 0, never.",
        ),
    ] = 0.0


@dataclass(frozen=True, config=STRICT)
class StaircaseRule:
    """A transformed up-down rule. All numbers without a default are the experimenter's to state."""

    start_n: Annotated[float, Field(ge=0.001, le=3.0, description="Level of the first trial of every run, in newtons.")]
    cap_n: Annotated[
        float,
        Field(
            gt=0, le=3.0, description="No level is above this, in newtons; 3 N at the most. Only roving goes beyond it."
        ),
    ]
    up_after_wrong: Annotated[int, Field(ge=1, le=10, description="Wrong answers in a row that raise the level.")]
    down_after_right: Annotated[int, Field(ge=1, le=10, description="Right answers in a row that lower the level.")]
    steps: Annotated[tuple[StepPhase, ...], Field(min_length=1, description="Step sizes, phase by phase.")]
    reversals: Annotated[int, Field(ge=2, le=100, description="The run ends at once with this reversal.")]
    averaged_reversals: Annotated[
        int, Field(ge=1, le=100, description="The threshold is the mean of this many last peaks and valleys.")
    ]
    step_change: Annotated[
        StepChange,
        Field(
            description="Step used at the reversal that completes a phase. Default: the old one, because "
            "a phase of three reversals 'at 4 dB' means that its third reversal moves by 4 dB too."
        ),
    ] = StepChange.AFTER_REVERSAL
    initial_one_up_one_down: Annotated[
        bool,
        Field(
            description="Move after every answer until the first reversal. Default: no, because the rule is stated "
            "for the whole run, and the shortcut raises the spread of the threshold by 30 to 55 %."
        ),
    ] = False
    reversal: Annotated[
        Literal["level_direction"],
        Field(
            description="What a reversal is. Default, and the only one offered: a change of the level's direction, the "
            "first movement being none, because alternating answers alone make no peaks and valleys to average."
        ),
    ] = "level_direction"
    at_cap: Annotated[
        Literal["clamp"],
        Field(
            description="What happens at the cap. Default, and the only one offered: a movement beyond the cap stops "
            "at the cap and goes on from there; a push against it is no reversal, because no peak is made. Both are "
            "counted."
        ),
    ] = "clamp"
    mean: Annotated[
        Literal["newton"],
        Field(
            description="How the peaks and valleys are averaged. Default, and the only one offered: arithmetic mean in "
            "newtons, the unit of the published figure; the mean in dB is always written beside it."
        ),
    ] = "newton"
    trial_limit: Annotated[
        int,
        Field(
            ge=0,
            le=10_000,
            description="End a run after this many trials even without its reversals; 0 = never. Default: "
            "never, as published; a pure guesser needs about 110 trials.",
        ),
    ] = 0

    bayesian: Annotated[
        BayesianPlacement,
        Field(
            description="Levels that tell most, in place of the up-down rule (Kontsevich and Tyler 1999). Steps and "
            "reversals above are then not used, and the threshold is the posterior mean. Default: off, as published."
        ),
    ] = BayesianPlacement()

    @property
    def is_bayesian(self) -> bool:
        """Whether the Psi method chooses the levels in place of the up-down rule."""
        return self.bayesian.trials > 0

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        problems = []
        if self.start_n > self.cap_n:
            problems.append(Problem("start_n", f"is {self.start_n} N, above cap_n", f"at most {self.cap_n} N, the cap"))
        if self.averaged_reversals > self.reversals:
            problems.append(
                Problem(
                    "averaged_reversals",
                    f"is {self.averaged_reversals}, more than a run has",
                    f"at most {self.reversals}, the number in reversals",
                )
            )
        planned = sum(phase.reversals for phase in self.steps)
        if planned != self.reversals:
            problems.append(
                Problem(
                    "steps",
                    f"plan {planned} reversals in all, but the run ends after {self.reversals}",
                    "phases whose reversals add up to the number in reversals",
                )
            )
        refuse([*problems, *_placement_problems(self)])
        return self


def _placement_problems(rule: StaircaseRule) -> list[Problem]:
    """Contradictions between the keys of the up-down rule and those of Psi."""
    bayesian, problems = rule.bayesian, []
    if bayesian.spread_db and not rule.is_bayesian:
        wrong = f"is {bayesian.spread_db} dB, but bayesian.trials is 0"
        problems.append(Problem("bayesian.spread_db", wrong, "0, or a number of trials in bayesian.trials"))
    if rule.is_bayesian and rule.initial_one_up_one_down:
        wrong = "is true, but Psi chooses the levels (bayesian.trials), and there is no reversal to wait for"
        problems.append(Problem("initial_one_up_one_down", wrong, "false, or 0 in bayesian.trials"))
    return problems
