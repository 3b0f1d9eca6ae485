"""Schema of the [staircase] table of a protocol: settings of a transformed up-down rule, or of the Psi method.

A transformed up-down rule (Levitt, Journal of the Acoustical Society of America 49 (1971), 467) raises the level after
a number of wrong answers in a row and lowers it after a number of right ones; its levels settle where both are equally
likely (1 up, 3 down: 79.4 % right). The rule is computed by `protocols.procedure.staircase`, Psi by
`protocols.procedure.psi`. Field of `study_protocol.StudyProtocol`; the descriptions are printed in docs/formats.md and
in the JSON schema. 3 N is the safety limit of a stimulus with a hand (docs/safety.md); the other bounds are chosen.
"""

from enum import Enum
from typing import Annotated, Literal, Self

from pydantic import ConfigDict, Field, model_validator
from pydantic.dataclasses import dataclass

from protocols.definition.field_types import MAX_AMPLITUDE_N
from protocols.definition.problem import Problem, refuse

STRICT = ConfigDict(extra="forbid", allow_inf_nan=False)
"""pydantic configuration of all settings classes of a protocol and of the lab's settings file: unknown keys, infinities
and NaN are refused."""


class StepChange(Enum):
    """Trial at which the next step size takes effect.

    Published staircases of "4 dB, then 1 dB" differ in this: AT_REVERSAL gives thresholds 0.7 to 1.1 dB lower than
    AFTER_REVERSAL in simulations (tests/references/staircase_variants.py).
    """

    AFTER_REVERSAL = "after_reversal"
    """The movement at the reversal that completes a phase has the old step, every later movement the new one."""
    AT_REVERSAL = "at_reversal"
    """The movement at the reversal that completes a phase already has the new step."""
    AT_NEXT_REVERSAL = "at_next_reversal"
    """Movements have the old step until one more reversal has happened."""


@dataclass(frozen=True, config=STRICT)
class StepPhase:
    """A step size and the number of reversals for which it is used."""

    step_db: Annotated[float, Field(gt=0, le=20, description="Size of one movement, in dB.")]
    reversals: Annotated[int, Field(ge=1, le=100, description="Number of reversals of this phase.")]


@dataclass(frozen=True, config=STRICT)
class BayesianPlacement:
    """Levels by the Psi method (Kontsevich and Tyler, Vision Research 39 (1999), 2729) in place of the up-down rule;
    the method is in `protocols.procedure.psi`."""

    trials: int = Field(
        default=0,
        ge=0,
        le=500,
        description="Number of trials of a run at levels chosen by Psi, from the cap downwards in steps of 1 dB; "
        "0: the up-down rule. The first trial is at start_n in either case. Default: 0, as published.",
    )
    spread_db: float = Field(
        default=0.0,
        ge=0,
        le=20,
        description="Standard deviation of the threshold's posterior, in dB, at which a run ends earlier. "
        "Default: 0, never.",
    )


@dataclass(frozen=True, config=STRICT)
class StaircaseRule:
    """Rule that chooses the levels of a run: a transformed up-down rule, or the Psi method (`bayesian`). Numbers
    without a default must be stated by the experimenter."""

    start_n: Annotated[
        float, Field(ge=0.001, le=MAX_AMPLITUDE_N, description="Level of the first trial of every run, in newtons.")
    ]
    cap_n: Annotated[
        float,
        Field(gt=0, le=MAX_AMPLITUDE_N, description="Highest level, in newtons; at most 3 N. Only roving exceeds it."),
    ]
    up_after_wrong: Annotated[
        int, Field(ge=1, le=10, description="Number of wrong answers in a row that raise the level.")
    ]
    down_after_right: Annotated[
        int, Field(ge=1, le=10, description="Number of right answers in a row that lower the level.")
    ]
    steps: Annotated[tuple[StepPhase, ...], Field(min_length=1, description="Step sizes, one entry for each phase.")]
    reversals: Annotated[
        int, Field(ge=2, le=100, description="Number of reversals of a run; the run ends with the last of them.")
    ]
    averaged_reversals: Annotated[
        int, Field(ge=1, le=100, description="Number of last peaks and valleys whose mean is the threshold.")
    ]
    step_change: StepChange = Field(
        default=StepChange.AFTER_REVERSAL,
        description="Step size at the reversal that completes a phase. Default: the old one, because a phase of "
        "three reversals 'at 4 dB' means that the movement at its third reversal is 4 dB too.",
    )
    initial_one_up_one_down: bool = Field(
        default=False,
        description="Whether the level moves after every answer until the first reversal. Default: no, because "
        "the rule is stated for the whole run, and this shortcut raises the spread of the threshold by 30 to 55 "
        "%.",
    )
    reversal: Literal["level_direction"] = Field(
        default="level_direction",
        description="Definition of a reversal. Default, and the only value: a change of the level's direction. "
        "The first movement is not a reversal, because answers that merely alternate produce no peaks and "
        "valleys to average.",
    )
    at_cap: Literal["clamp"] = Field(
        default="clamp",
        description="Behaviour at the cap. Default, and the only value: a movement beyond the cap ends at the "
        "cap, and the next one starts there. An upward movement at the cap changes nothing and is not a "
        "reversal, because the level does not change its direction. Both are counted.",
    )
    mean: Literal["newton"] = Field(
        default="newton",
        description="Mean of the peaks and valleys. Default, and the only value: arithmetic mean in newtons, the "
        "unit of the published figure. The mean in dB is written in addition.",
    )
    trial_limit: int = Field(
        default=0,
        ge=0,
        le=10_000,
        description="Number of trials after which a run ends even without its reversals; 0 = never. Default: "
        "never, as published. A participant who only guesses needs about 110 trials.",
    )

    bayesian: BayesianPlacement = Field(
        default=BayesianPlacement(),
        description="Psi method (Kontsevich and Tyler 1999) in place of the up-down rule: each level is the one "
        "whose answer is expected to leave the lowest entropy of threshold and slope. Steps and reversals above "
        "are then not used, and the threshold is the posterior mean. Default: off, as published.",
    )

    @property
    def is_bayesian(self) -> bool:
        """Whether the Psi method chooses the levels in place of the up-down rule."""
        return self.bayesian.trials > 0

    @model_validator(mode="after")
    def _require_consistent_rule(self) -> Self:
        """Raise InconsistentError where values of the table contradict each other."""
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
        planned_reversals = sum(phase.reversals for phase in self.steps)
        if planned_reversals != self.reversals:
            problems.append(
                Problem(
                    "steps",
                    f"plan {planned_reversals} reversals in all, but the run ends after {self.reversals}",
                    "phases whose reversals add up to the number in reversals",
                )
            )
        refuse([*problems, *_find_placement_problems(self)])
        return self


def _find_placement_problems(rule: StaircaseRule) -> list[Problem]:
    """Find keys of the Psi method that are set without it, and keys of the up-down rule that it does not allow."""
    bayesian, problems = rule.bayesian, []
    if bayesian.spread_db and not rule.is_bayesian:
        problem_text = f"is {bayesian.spread_db} dB, but bayesian.trials is 0"
        problems.append(Problem("bayesian.spread_db", problem_text, "0, or a number of trials in bayesian.trials"))
    if rule.is_bayesian and rule.initial_one_up_one_down:
        problem_text = "is true, but Psi chooses the levels (bayesian.trials), and there is no reversal to wait for"
        problems.append(Problem("initial_one_up_one_down", problem_text, "false, or 0 in bayesian.trials"))
    return problems
