"""Parts of a sitting around its trials: consent, set-up, demonstration, practice, debrief."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator
from pydantic.dataclasses import dataclass

from protocols.definition.field_types import StimulusFrequency
from protocols.definition.participant_text import Sentence
from protocols.definition.problem import Problem, refuse
from protocols.definition.staircase_rule import STRICT

RoveDb = Annotated[
    float,
    Field(
        ge=0,
        le=20,
        description="Width of the range, level_n in its middle, from which each amplitude is drawn evenly in dB, "
        "for all directions alike. At one fixed level, labels and feedback teach how strong each direction "
        "feels. With a range of r dB, a difference of d dB between the directions allows at most 50 + 50 d / r "
        "% right answers by strength alone. Default 0: one fixed level, as in older protocols.",
    ),
]


@dataclass(frozen=True, config=STRICT)
class ConsentSettings:
    """What a participant agrees to, and what keeps a person from taking part."""

    version: Annotated[
        str,
        Field(
            max_length=40,
            description="Version of the wording; logged with the consent. Default: empty, for no wording.",
        ),
    ] = ""
    ethics_id: Annotated[
        str,
        Field(max_length=80, description="Approval of the ethics committee; shown and logged. Default: none yet."),
    ] = ""
    statements: Annotated[
        tuple[Sentence, ...],
        Field(max_length=12, description="Each must be agreed to. Default: none, and no consent is asked for."),
    ] = ()
    exclusions: Annotated[
        tuple[Sentence, ...],
        Field(
            max_length=12,
            description="Questions; one yes ends the sitting before anything is played. Only the outcome is kept, "
            "because the answers are about health. Default: none are asked.",
        ),
    ] = ()

    @model_validator(mode="after")
    def _has_version(self) -> Self:
        if (self.statements or self.exclusions) and not self.version:
            refuse([Problem("version", "is empty, although something is asked", "the version of the wording")])
        return self


@dataclass(frozen=True, config=STRICT)
class SetupSettings:
    """How a participant sits at the device, asked for and logged at the start of every sitting, and in which state that
    must be."""

    ask: Annotated[bool, Field(description="Whether the questions on the set-up are asked. Default: no.")] = False
    hearing_masked: Annotated[
        bool,
        Field(description="Ear protection or masking noise is wanted. Default: yes, because a device can be heard."),
    ] = True
    hand_hidden: Annotated[
        bool, Field(description="The hand should be out of sight. Default: yes, because a handle can be seen moving.")
    ] = True
    arm_supported: Annotated[
        bool, Field(description="The forearm should rest on something. Default: yes, because tired arms feel less.")
    ] = True
    grip: Annotated[
        str,
        Field(max_length=80, description="The grip that the participant should use. Default: as published, constant."),
    ] = "constant and comfortable"
    daily_check_needed: Annotated[
        bool,
        Field(
            description="Whether a session on a real device begins only if that device has passed `hapteq doctor "
            "--daily` on the same day. Default: no, a warning is shown where it has not."
        ),
    ] = False


@dataclass(frozen=True, config=STRICT)
class MaskingSettings:
    """Noise that the program plays from its own sound output, so that the device is not heard: pink, as that of
    `hapteq noise`."""

    play: Annotated[
        bool,
        Field(
            description="Whether the program plays the noise, from before the demonstration to the end except in "
            "pauses, and begins no session of a person where it cannot. Default: no, the lab plays the file of "
            "`hapteq noise`."
        ),
    ] = False
    level_db: Annotated[
        float,
        Field(
            ge=-60,
            le=0,
            description="Level, re the file of `hapteq noise`; its highest sample lies 3 dB below full scale. What a "
            "participant hears depends on the output: measure it there. Default -20.",
        ),
    ] = -20.0
    low_hz: Annotated[float, Field(ge=1, le=20_000, description="Lower corner. Default 40.")] = 40.0
    high_hz: Annotated[float, Field(ge=1, le=20_000, description="Upper corner. Default 8000.")] = 8000.0
    seed: Annotated[int, Field(ge=0, le=2**32 - 1, description="Another seed gives other noise. Default 1.")] = 1

    @model_validator(mode="after")
    def _has_band(self) -> Self:
        if self.high_hz < self.low_hz + 1:
            wrong = f"is {self.high_hz:g}, not above low_hz by 1 Hz"
            refuse([Problem("high_hz", wrong, f"at least {self.low_hz + 1:g}")])
        return self


@dataclass(frozen=True, config=STRICT)
class DemoSettings:
    """Both directions at every frequency, labelled, before anything is asked."""

    level_n: Annotated[
        float, Field(ge=0, le=3.0, description="Amplitude, in newtons. Default 0: no demonstration.")
    ] = 0.0
    rove_db: RoveDb = 0.0
    seconds: Annotated[float, Field(ge=0.5, le=20, description="Duration of each. Default 2: ten periods at 5 Hz.")] = (
        2.0
    )


@dataclass(frozen=True, config=STRICT)
class PracticeSettings:
    """A short run around one level for each frequency, passed by right answers. It enters no result."""

    frequencies_hz: Annotated[
        tuple[StimulusFrequency, ...],
        Field(max_length=20, description="One practice run each, in this order, after the training. Default: none."),
    ] = ()
    level_n: Annotated[
        float,
        Field(
            ge=0.001,
            le=3.0,
            description="Amplitude of every practice trial. Default 2: well above most thresholds, well below the cap.",
        ),
    ] = 2.0
    rove_db: RoveDb = 0.0
    right_needed: Annotated[
        int,
        Field(ge=1, le=50, description="Passed with this number of right answers among the last `of_last`. Default 4."),
    ] = 4
    of_last: Annotated[
        int, Field(ge=1, le=50, description="See `right_needed`. Default 5: by guessing, 4 of 5 has a chance of 19 %.")
    ] = 5
    trial_limit: Annotated[
        int,
        Field(
            ge=1,
            le=200,
            description="A practice run ends after this number of trials, passed or not. Default 10. Not passing "
            "excludes no participant: at high frequencies it is a finding.",
        ),
    ] = 10
    feedback: Annotated[
        Literal["none", "after_answer"],
        Field(
            description="As trial.feedback, for practice alone. Default: after each answer, so that it can be learnt."
        ),
    ] = "after_answer"

    @model_validator(mode="after")
    def _reachable(self) -> Self:
        problems = []
        if self.right_needed > self.of_last:
            wrong = f"is {self.right_needed}, more than of_last"
            problems.append(Problem("right_needed", wrong, f"at most {self.of_last}"))
        if self.trial_limit < self.of_last:
            problems.append(Problem("trial_limit", f"is {self.trial_limit}, below of_last", f"at least {self.of_last}"))
        refuse(problems)
        return self
