"""A recording as data: which excitations are played, where, and what holds the handle meanwhile."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator
from pydantic.dataclasses import dataclass

from protocols.apparatus import SafetySettings, SpringSettings, TestDirections
from protocols.field_types import Frequency, Name, Source, Title
from protocols.problem import Problem, refuse
from protocols.staircase_rule import STRICT

Amplitude = Annotated[float, Field(gt=0, le=3.0, description="Peak of the force, in newtons.")]
Along = Annotated[
    Literal["x", "y", "z", "direction_1", "direction_2"],
    Field(description="A device axis, or one of the two test directions."),
]


@dataclass(frozen=True, config=STRICT)
class SineSegment:
    """Sinusoids one after another, each long enough to be steady before it counts."""

    kind: Annotated[Literal["sine"], Field(description="Sinusoids, one after another.")]
    frequencies_hz: Annotated[
        tuple[Frequency, ...], Field(min_length=1, max_length=100, description="Played in this order.")
    ]
    amplitude_n: Amplitude
    along: Along
    duration_s: Annotated[float, Field(gt=0, le=600, description="Counted part of every sinusoid, whole periods.")]
    settle_s: Annotated[
        float,
        Field(ge=0, le=60, description="Played before it and not counted. Default 1: resonances have died by then."),
    ] = 1.0


@dataclass(frozen=True, config=STRICT)
class SweepSegment:
    """A periodic logarithmic swept sine; the first period is there to let the transient die."""

    kind: Annotated[Literal["sweep"], Field(description="A logarithmic swept sine.")]
    from_hz: Annotated[Frequency, Field(description="Lowest frequency, where every period begins.")]
    to_hz: Annotated[Frequency, Field(description="Highest frequency, where every period ends.")]
    amplitude_n: Amplitude
    along: Along
    duration_s: Annotated[float, Field(gt=0, le=600, description="One period.")]
    periods: Annotated[
        int,
        Field(
            ge=1,
            le=100,
            description="Periods played, the transient's included. Default 2: one for the transient, one to count.",
        ),
    ] = 2

    @model_validator(mode="after")
    def _upwards(self) -> Self:
        if self.to_hz <= self.from_hz:
            refuse(
                [Problem("to_hz", f"is {self.to_hz} Hz, not above from_hz", f"above {self.from_hz} Hz, the from_hz")]
            )
        return self


Segment = Annotated[SineSegment | SweepSegment, Field(discriminator="kind")]


@dataclass(frozen=True, config=STRICT)
class RecordingProtocol:
    """Excitations that `hapteq record` plays one after another into one recording."""

    name: Name
    kind: Annotated[Literal["recording"], Field(description="Played by `hapteq record`.")]
    title: Title
    segments: Annotated[
        tuple[Segment, ...], Field(min_length=1, max_length=200, description="Excitations, played in this order.")
    ]
    safety: SafetySettings
    source: Source = ""
    directions: TestDirections = Field(default_factory=TestDirections)
    spring: SpringSettings = Field(default_factory=SpringSettings)
    hand: Annotated[
        Literal["none", "held"],
        Field(description="Whether somebody holds the handle. Default 'none': a spring repeats, a grip does not."),
    ] = "none"
    rest_s: Annotated[
        float,
        Field(
            ge=0.1,
            le=60,
            description="Rest before, between and after the excitations. Default 1: vibrations have died by then, and "
            "the sensor's noise is on record.",
        ),
    ] = 1.0
    repeats: Annotated[
        int,
        Field(
            ge=1,
            le=100,
            description="How often the whole list is played. Default 1; more tell repeat noise from the device.",
        ),
    ] = 1
    fade_s: Annotated[
        float,
        Field(gt=0, le=5, description="Every excitation rises and falls over this time. Default 0.1: no click."),
    ] = 0.1

    @model_validator(mode="after")
    def _within_caps(self) -> Self:
        cap_n = self.safety.stimulus_cap_n
        refuse(
            [
                Problem(
                    f"segments[{number}].amplitude_n",
                    f"is {segment.amplitude_n} N, above safety.stimulus_cap_n",
                    f"above 0 and at most {cap_n} N, the cap",
                )
                for number, segment in enumerate(self.segments, start=1)
                if segment.amplitude_n > cap_n
            ]
        )
        return self
