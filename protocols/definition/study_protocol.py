"""Schema of a study protocol (pydantic): all settings of a session, with units, bounds, defaults and their reasons.

Built from TOML by `protocols.document.loading`; a protocol whose settings contradict each other is refused with
`problem.InconsistentError`, which Pydantic wraps in its ValidationError. Classes and descriptions are the source of
docs/formats.md and of the JSON schema. The bounds of the fields are chosen.
"""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator
from pydantic.dataclasses import dataclass

from protocols.definition.apparatus import SafetySettings, SpringSettings, TestDirections
from protocols.definition.declared_analysis import AnalysisSettings
from protocols.definition.field_types import Name, Source, StimulusFrequency, Title
from protocols.definition.measurement import MeasurementSettings
from protocols.definition.participant_text import Question, TextSettings
from protocols.definition.preparation import (
    ConsentSettings,
    DemoSettings,
    MaskingSettings,
    PracticeSettings,
    SetupSettings,
)
from protocols.definition.probes import ProbeSettings
from protocols.definition.problem import Problem, refuse
from protocols.definition.session_settings import CatchSettings, DetectionSettings, GateSettings, SittingLimits
from protocols.definition.staircase_rule import STRICT, StaircaseRule
from protocols.definition.study_contradictions import find_contradictions


@dataclass(frozen=True, config=STRICT)
class StimulusSettings:
    """One sinusoidal force along one of two directions, held until the answer."""

    frequencies_hz: Annotated[
        tuple[StimulusFrequency, ...],
        Field(
            max_length=20,
            description="Frequencies in hertz, one staircase each. Empty for a session that consists of training only.",
        ),
    ]
    quantity: Literal["commanded_force", "delivered_acceleration"] = Field(
        default="commanded_force",
        description="Quantity that the staircase changes. Default: the commanded force, as published. "
        "'delivered_acceleration' needs an equalizer model and is refused without one.",
    )
    fade_in_s: float = Field(
        default=0.5,
        gt=0,
        le=5,
        description="Time over which the amplitude rises. Default 0.5: two and a half periods at 5 Hz, so that "
        "no onset reveals the direction.",
    )
    fade_out_s: float = Field(
        default=0.25,
        gt=0,
        le=5,
        description="Time over which the amplitude falls after the answer. Default 0.25: no jerk, no waiting.",
    )
    fade_shape: Literal["raised_cosine", "linear"] = Field(
        default="raised_cosine",
        description="Shape of the fades. Default: raised cosine. It has no corner at either end, and therefore "
        "no click.",
    )
    onset_polarity: Literal["random", "positive"] = Field(
        default="random",
        description="Sign of the first half-wave. Default: random, so that the first push does not reveal the "
        "direction.",
    )
    rove_db: float = Field(
        default=0.0,
        ge=0,
        le=20,
        description="Width of the range from which the amplitude of each trial is drawn, uniformly in dB and for "
        "both directions alike; the staircase's level is its middle. Applies to staircases on directions, as a "
        "control that directions are not distinguished by strength. With a range of r dB, a difference of d dB "
        "between the directions allows at most 50 + 50 d / r % right answers by strength alone. Half of the "
        "range lies above the level, so that staircase.cap_n must leave room below safety.stimulus_cap_n. "
        "Default 0: each trial at the staircase's level, as published.",
    )

    @model_validator(mode="after")
    def _check_distinct(self) -> Self:
        """Raise InconsistentError where a frequency is listed twice."""
        if len(set(self.frequencies_hz)) != len(self.frequencies_hz):
            refuse([Problem("frequencies_hz", "names a frequency twice", "every frequency once")])
        return self


@dataclass(frozen=True, config=STRICT)
class ScheduleSettings:
    """Order of the frequencies, and randomisation of directions and labels."""

    order: Literal["random", "williams", "as_listed"] = Field(
        default="random",
        description="Order of the frequencies. Default: random, as published; 'williams' balances "
        "position and first-order carry-over over participants.",
    )
    directions: Literal["independent", "balanced"] = Field(
        default="independent",
        description="Randomisation of the directions. Default: independent, so that a run of equal directions "
        "does not predict the next one. 'balanced' shows both equally often within every eight trials.",
    )
    labels: Literal["fixed", "swapped_for_half"] = Field(
        default="fixed",
        description="Whether the numbers 1 and 2 are exchanged for every second participant. Default: fixed, as "
        "published. Exchanged numbers separate a bias towards a key from a bias towards a direction.",
    )


@dataclass(frozen=True, config=STRICT)
class TrialSettings:
    """Answer of a trial: buttons, feedback, repeats and time limit; and the pause after it."""

    device_buttons: tuple[int, ...] = Field(
        default=(),
        max_length=2,
        description="Numbers of the device's buttons that answer 1 and 2, in addition to the keys. Default: none.",
    )

    feedback: Literal["none", "after_answer"] = Field(
        default="none",
        description="Whether the participant is told if the answer was right. Default: none, because none is "
        "published, and because feedback would teach cues other than direction.",
    )
    repeats_per_run: int = Field(
        default=3,
        ge=0,
        le=100,
        description="Number of times in a run that the participant may ask for the same stimulus again; 0: "
        "never. Default 3: for a cough or a noise in some 60 trials.",
    )
    time_limit_s: float = Field(
        default=0.0, ge=0, le=600, description="Longest time to answer. Default 0: no limit, as published."
    )
    pause_between_s: float = Field(
        default=0.5,
        ge=0,
        le=60,
        description="Time without a stimulus between an answer and the next stimulus. Default 0.5: the next "
        "onset is felt as new.",
    )


@dataclass(frozen=True, config=STRICT)
class TrainingSettings:
    """Training runs before the test runs. They follow the same rule, and their trials are not part of any result."""

    frequencies_hz: tuple[StimulusFrequency, ...] = Field(
        default=(),
        max_length=20,
        description="One training run for each frequency, in this order. Default: no training.",
    )
    trial_limit: int = Field(
        default=0,
        ge=0,
        le=1000,
        description="Number of trials after which a training run ends at the latest. Default 0: a whole "
        "staircase, so that no participant starts untrained.",
    )
    feedback: Literal["none", "after_answer"] = Field(
        default="none",
        description="Like trial.feedback, for the training alone. Default: none, like the trials that it prepares.",
    )


@dataclass(frozen=True, config=STRICT)
class RestSettings:
    """Enforced pauses, because vibration numbs the hand."""

    after_run_s: float = Field(
        default=60.0,
        ge=0,
        le=3600,
        description="Shortest rest between two runs. Default 60: numbness fades in a minute.",
    )
    after_trials: int = Field(
        default=0,
        ge=0,
        le=1000,
        description="Number of trials after which a rest within a run follows. Default 0: no rest, because a run "
        "takes minutes.",
    )
    within_run_s: float = Field(
        default=30.0,
        ge=0,
        le=3600,
        description="Shortest rest within a run. Default 30; not used while after_trials is 0.",
    )


@dataclass(frozen=True, config=STRICT)
class StudyProtocol:
    """A forced-choice staircase study on two directions."""

    name: Name
    kind: Annotated[Literal["study"], Field(description="Kind of the protocol: a study, run with `hapteq study`.")]
    title: Title
    stimulus: StimulusSettings
    staircase: StaircaseRule
    directions: TestDirections
    safety: SafetySettings
    source: Source = ""
    schedule: ScheduleSettings = Field(default_factory=ScheduleSettings)
    trial: TrialSettings = Field(default_factory=TrialSettings)
    training: TrainingSettings = Field(default_factory=TrainingSettings)
    rests: RestSettings = Field(default_factory=RestSettings)
    spring: SpringSettings = Field(default_factory=SpringSettings)
    measurement: MeasurementSettings = Field(default_factory=MeasurementSettings)
    consent: ConsentSettings = Field(default_factory=ConsentSettings)
    setup: SetupSettings = Field(default_factory=SetupSettings)
    masking: MaskingSettings = Field(default_factory=MaskingSettings)
    demo: DemoSettings = Field(default_factory=DemoSettings)
    practice: PracticeSettings = Field(default_factory=PracticeSettings)
    detection: DetectionSettings = Field(default_factory=DetectionSettings)
    catch: CatchSettings = Field(default_factory=CatchSettings)
    gate: GateSettings = Field(default_factory=GateSettings)
    limits: SittingLimits = Field(default_factory=SittingLimits)
    probes: ProbeSettings = Field(default_factory=ProbeSettings)
    analysis: AnalysisSettings = Field(default_factory=AnalysisSettings)
    text: TextSettings = Field(default_factory=TextSettings)
    before: tuple[Question, ...] = Field(
        default=(), max_length=20, description="Questions before the first trial, such as age. Default: none."
    )
    debrief: tuple[Question, ...] = Field(
        default=(), max_length=20, description="Questions after the last run. Default: none."
    )

    @property
    def all_frequencies_hz(self) -> tuple[float, ...]:
        """All frequencies (Hz) of test, training, practice and detection, each once, ascending."""
        tables = (self.stimulus, self.training, self.practice, self.detection)
        return tuple(sorted({frequency_hz for table in tables for frequency_hz in table.frequencies_hz}))

    @model_validator(mode="after")
    def _check_consistency(self) -> Self:
        """Raise InconsistentError where tables contradict each other."""
        refuse(find_contradictions(self))
        return self
