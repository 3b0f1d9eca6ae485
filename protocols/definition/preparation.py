"""Settings of the preparation of a sitting: consent, set-up, masking noise, demonstration, practice.

Each class is a table of the TOML file; Pydantic checks its values. Part of `study_protocol`. Played and asked by
`study.workflows.trial` and `study.session.views.forms`; `protocols.procedure.practice` evaluates the criterion.
"""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator
from pydantic.dataclasses import dataclass

from protocols.definition.field_types import MAX_AMPLITUDE_N, StimulusFrequency
from protocols.definition.participant_text import Sentence
from protocols.definition.problem import Problem, refuse
from protocols.definition.staircase_rule import STRICT

RoveDb = Annotated[
    float,
    Field(
        ge=0,
        le=20,
        description="Width of the range from which each amplitude is drawn, uniformly in dB and for all "
        "directions alike; level_n is its middle. At one fixed level, labels and feedback teach how strong each "
        "direction feels. With a range of r dB, a difference of d dB between the directions allows at most 50 + "
        "50 d / r % right answers by strength alone. Default 0: one fixed level, as in older protocols.",
    ),
]


@dataclass(frozen=True, config=STRICT)
class ConsentSettings:
    """Consent of the participant, and exclusion criteria."""

    version: str = Field(
        default="",
        max_length=40,
        description="Version of the wording; logged with the consent. Default: empty, for no wording.",
    )
    ethics_id: str = Field(
        default="", max_length=80, description="Approval of the ethics committee; shown and logged. Default: none yet."
    )
    statements: tuple[Sentence, ...] = Field(
        default=(),
        max_length=12,
        description="Statements, each of which the participant must agree to. Default: none, and consent is not "
        "asked for.",
    )
    exclusions: tuple[Sentence, ...] = Field(
        default=(),
        max_length=12,
        description="Questions; one answer 'yes' ends the sitting before any stimulus is played. Only the "
        "outcome is stored, because the answers concern health. Default: none.",
    )

    @model_validator(mode="after")
    def _require_version(self) -> Self:
        """Raise InconsistentError for statements or exclusions without a version."""
        if (self.statements or self.exclusions) and not self.version:
            refuse([Problem("version", "is empty, although something is asked", "the version of the wording")])
        return self


@dataclass(frozen=True, config=STRICT)
class SetupSettings:
    """Set-up and posture of the participant, with the required values. Where `ask` is true, they are asked for and
    logged at the start of every sitting."""

    ask: Annotated[bool, Field(description="Whether the questions on the set-up are asked. Default: no.")] = False
    hearing_masked: bool = Field(
        default=True,
        description="Ear protection or masking noise is required. Default: yes, because a device can be heard.",
    )
    hand_hidden: bool = Field(
        default=True, description="The hand should be out of sight. Default: yes, because a handle can be seen moving."
    )
    arm_supported: bool = Field(
        default=True, description="The forearm should rest on something. Default: yes, because tired arms feel less."
    )
    grip: str = Field(
        default="constant and comfortable",
        max_length=80,
        description="Grip that the participant should use. Default: as published, constant.",
    )
    daily_check_needed: bool = Field(
        default=False,
        description="Whether a session on a real device begins only if that device has passed `hapteq doctor "
        "--daily` on the same day. Default: no; if it has not passed, a warning is shown.",
    )


@dataclass(frozen=True, config=STRICT)
class MaskingSettings:
    """Pink masking noise that the program plays, so that the device is not heard; `hapteq noise` writes it to a
    file."""

    play: bool = Field(
        default=False,
        description="Whether the program plays the noise, from before the demonstration to the end, except in "
        "pauses. Without a working sound output no session of a person begins then. Default: no, the lab plays "
        "the file of `hapteq noise`.",
    )
    level_db: float = Field(
        default=-20.0,
        ge=-60,
        le=0,
        description="Level in dB re the file of `hapteq noise`, whose highest sample lies 3 dB below full scale. "
        "The level at the participant's ear depends on the output: measure it there. Default -20.",
    )
    low_hz: float = Field(default=40.0, ge=1, le=20_000, description="Lower corner frequency of the band. Default 40.")
    high_hz: float = Field(
        default=8000.0, ge=1, le=20_000, description="Upper corner frequency of the band. Default 8000."
    )
    seed: int = Field(
        default=1, ge=0, le=2**32 - 1, description="Seed of the noise; another seed gives other noise. Default 1."
    )

    @model_validator(mode="after")
    def _require_rising_band(self) -> Self:
        """Raise InconsistentError unless high_hz is at least 1 Hz above low_hz."""
        if self.high_hz < self.low_hz + 1:
            problem_text = f"is {self.high_hz:g}, not above low_hz by 1 Hz"
            refuse([Problem("high_hz", problem_text, f"at least {self.low_hz + 1:g}")])
        return self


@dataclass(frozen=True, config=STRICT)
class DemoSettings:
    """Labelled demonstration of both directions at every frequency, before the first question."""

    level_n: float = Field(
        default=0.0, ge=0, le=MAX_AMPLITUDE_N, description="Amplitude, in newtons. Default 0: no demonstration."
    )
    rove_db: RoveDb = 0.0
    seconds: float = Field(
        default=2.0, ge=0.5, le=20, description="Duration of each stimulus. Default 2: ten periods at 5 Hz."
    )


@dataclass(frozen=True, config=STRICT)
class PracticeSettings:
    """Practice runs, one for each frequency, at a fixed level (roved if `rove_db` is above 0), until a criterion of
    right answers is met or `trial_limit` is reached. Their trials are not part of any result."""

    frequencies_hz: tuple[StimulusFrequency, ...] = Field(
        default=(),
        max_length=20,
        description="One practice run for each frequency, in this order, after the training. Default: none.",
    )
    level_n: float = Field(
        default=2.0,
        ge=0.001,
        le=MAX_AMPLITUDE_N,
        description="Amplitude of the practice trials, or the middle of its range (`rove_db`). Default 2: well "
        "above most thresholds, well below the cap.",
    )
    rove_db: RoveDb = 0.0
    right_needed: int = Field(
        default=4,
        ge=1,
        le=50,
        description="Number of right answers among the last `of_last` that passes the practice. Default 4.",
    )
    of_last: int = Field(
        default=5,
        ge=1,
        le=50,
        description="Number of last answers that are counted, see `right_needed`. Default 5: guessing gives 4 or "
        "more of 5 with a probability of 19 %, and passes within the 10 trials of `trial_limit` with 45 %.",
    )
    trial_limit: int = Field(
        default=10,
        ge=1,
        le=200,
        description="Number of trials after which a practice run ends, passed or not. Default 10. A participant "
        "who does not pass is not excluded: at high frequencies this is a result.",
    )
    feedback: Literal["none", "after_answer"] = Field(
        default="after_answer",
        description="Like trial.feedback, for the practice alone. Default: after each answer, so that the task "
        "can be learnt.",
    )

    @model_validator(mode="after")
    def _require_reachable_criterion(self) -> Self:
        """Raise InconsistentError where right_needed is above of_last, or trial_limit below it."""
        problems = []
        if self.right_needed > self.of_last:
            problem_text = f"is {self.right_needed}, more than of_last"
            problems.append(Problem("right_needed", problem_text, f"at most {self.of_last}"))
        if self.trial_limit < self.of_last:
            problems.append(Problem("trial_limit", f"is {self.trial_limit}, below of_last", f"at least {self.of_last}"))
        refuse(problems)
        return self
