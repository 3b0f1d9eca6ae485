"""A study as data: every number that a session needs, each with its unit, bounds and reason."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator
from pydantic.dataclasses import dataclass

from protocols.apparatus import SafetySettings, SpringSettings, TestDirections
from protocols.staircase_rule import STRICT, StaircaseRule

Name = Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]{0,63}$", description="Lower case, digits, underscores.")]
Frequency = Annotated[float, Field(ge=0.5, le=500.0)]


@dataclass(frozen=True, config=STRICT)
class StimulusSettings:
    """One sinusoidal force along one of two directions, held until the answer."""

    frequencies_hz: Annotated[
        tuple[Frequency, ...], Field(min_length=1, max_length=20, description="One staircase each, in hertz.")
    ]
    quantity: Annotated[
        Literal["commanded_force", "delivered_acceleration"],
        Field(
            description="What the staircase moves. Default: the commanded force, as published. "
            "'delivered_acceleration' needs an equalizer model and is refused without one."
        ),
    ] = "commanded_force"
    fade_in_s: Annotated[
        float,
        Field(
            gt=0,
            le=5,
            description="The amplitude rises over this time, so that no onset tells the direction.",
        ),
    ] = 0.5
    fade_out_s: Annotated[
        float, Field(gt=0, le=5, description="The amplitude falls over this time after the answer.")
    ] = 0.25
    fade_shape: Annotated[
        Literal["raised_cosine", "linear"],
        Field(description="Raised cosine by default: no corner at either end, hence no click."),
    ] = "raised_cosine"
    onset_polarity: Annotated[
        Literal["random", "positive"],
        Field(
            description="Sign of the first half-wave. Random by default, so that the first push does not "
            "tell the direction."
        ),
    ] = "random"

    @model_validator(mode="after")
    def _distinct(self) -> Self:
        if len(set(self.frequencies_hz)) != len(self.frequencies_hz):
            raise ValueError("frequencies_hz must not name a frequency twice")
        if any(abs(f * 10 - round(f * 10)) > 1e-9 for f in self.frequencies_hz):
            raise ValueError("frequencies_hz must be whole tenths of a hertz, so that a whole period can be looped")
        return self


@dataclass(frozen=True, config=STRICT)
class ScheduleSettings:
    order: Annotated[
        Literal["random", "williams", "as_listed"],
        Field(
            description="Order of the frequencies. Random by default, as published; 'williams' balances "
            "first-order carry-over over participants."
        ),
    ] = "random"
    directions: Annotated[
        Literal["independent", "balanced"],
        Field(
            description="Independent draws by default: no run of equal directions tells the next one. "
            "'balanced' shows both equally often within every eight trials."
        ),
    ] = "independent"
    labels: Annotated[
        Literal["fixed", "swapped_for_half"],
        Field(
            description="Whether the numbers 1 and 2 change places for every second participant. "
            "Fixed by default, as published; swapping separates a liking for a key from a direction."
        ),
    ] = "fixed"


@dataclass(frozen=True, config=STRICT)
class TrialSettings:
    feedback: Annotated[
        Literal["none", "after_answer"],
        Field(description="Whether the participant learns if the answer was right. None by default."),
    ] = "none"
    time_limit_s: Annotated[
        float,
        Field(ge=0, le=600, description="Longest time to answer; 0 = as long as wanted, as published."),
    ] = 0.0
    pause_between_s: Annotated[
        float,
        Field(
            ge=0,
            le=60,
            description="Still time between an answer and the next stimulus, to feel the onset anew.",
        ),
    ] = 0.5


@dataclass(frozen=True, config=STRICT)
class TrainingSettings:
    """Runs before the study proper. They follow the same rule and enter no result."""

    frequencies_hz: Annotated[
        tuple[Frequency, ...], Field(max_length=20, description="One training run each, in this order.")
    ] = ()
    trial_limit: Annotated[
        int,
        Field(
            ge=0,
            le=1000,
            description="A training run ends after this many trials at the latest; 0 = a whole staircase.",
        ),
    ] = 0
    feedback: Annotated[
        Literal["none", "after_answer"], Field(description="As in [trial], for the training alone.")
    ] = "none"


@dataclass(frozen=True, config=STRICT)
class RestSettings:
    """Enforced pauses: vibration numbs the hand."""

    after_run_s: Annotated[float, Field(ge=0, le=3600, description="Shortest rest between two runs.")] = 60.0
    after_trials: Annotated[
        int, Field(ge=0, le=1000, description="A rest within a run after this many trials; 0 = none.")
    ] = 0
    within_run_s: Annotated[float, Field(ge=0, le=3600, description="Shortest rest within a run.")] = 30.0


@dataclass(frozen=True, config=STRICT)
class MeasurementSettings:
    """What is kept of every trial, and when a trial is void because of the device."""

    keep_s: Annotated[
        float,
        Field(
            gt=0,
            le=60,
            description="The last whole periods of the steady part, this long at the most, are kept as a recording.",
        ),
    ] = 1.0
    missed_ticks_limit: Annotated[
        float,
        Field(
            ge=0,
            le=1,
            description="A trial with a larger share of missed 1 kHz ticks is void and drawn again.",
        ),
    ] = 0.02


@dataclass(frozen=True, config=STRICT)
class StudyProtocol:
    """A forced-choice staircase study on two directions."""

    name: Name
    kind: Literal["study"]
    title: Annotated[str, Field(min_length=1, max_length=200)]
    stimulus: StimulusSettings
    staircase: StaircaseRule
    directions: TestDirections
    safety: SafetySettings
    source: Annotated[str, Field(max_length=1000, description="Where the numbers come from.")] = ""
    schedule: ScheduleSettings = Field(default_factory=ScheduleSettings)
    trial: TrialSettings = Field(default_factory=TrialSettings)
    training: TrainingSettings = Field(default_factory=TrainingSettings)
    rests: RestSettings = Field(default_factory=RestSettings)
    spring: SpringSettings = Field(default_factory=SpringSettings)
    measurement: MeasurementSettings = Field(default_factory=MeasurementSettings)

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if self.safety.stimulus_cap_n < self.staircase.cap_n:
            raise ValueError(
                f"safety.stimulus_cap_n ({self.safety.stimulus_cap_n} N) is below staircase.cap_n "
                f"({self.staircase.cap_n} N): the highest levels could not be played"
            )
        if self.trial.time_limit_s > 0 and self.trial.time_limit_s >= self.safety.longest_trial_s:
            raise ValueError("trial.time_limit_s must be below safety.longest_trial_s, which releases the device")
        return self
