"""A recording as data: which excitations are played, where, and what holds the handle meanwhile."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator
from pydantic.dataclasses import dataclass

from protocols.apparatus import SafetySettings, SpringSettings, TestDirections
from protocols.staircase_rule import STRICT
from protocols.study_protocol import Frequency, Name

Amplitude = Annotated[float, Field(gt=0, le=3.0, description="Peak force in newtons.")]
Along = Annotated[
    Literal["x", "y", "z", "direction_1", "direction_2"],
    Field(description="A device axis, or one of the two test directions."),
]


@dataclass(frozen=True, config=STRICT)
class SineSegment:
    """Sinusoids one after another, each long enough to be steady before it counts."""

    kind: Literal["sine"]
    frequencies_hz: Annotated[tuple[Frequency, ...], Field(min_length=1, max_length=100)]
    amplitude_n: Amplitude
    along: Along
    duration_s: Annotated[float, Field(gt=0, le=600, description="Counted part of every sinusoid, whole periods.")]
    settle_s: Annotated[float, Field(ge=0, le=60, description="Played before it and not counted.")] = 1.0


@dataclass(frozen=True, config=STRICT)
class SweepSegment:
    """A periodic logarithmic swept sine; the first period is there to let the transient die."""

    kind: Literal["sweep"]
    from_hz: Frequency
    to_hz: Frequency
    amplitude_n: Amplitude
    along: Along
    duration_s: Annotated[float, Field(gt=0, le=600, description="One period.")]
    periods: Annotated[int, Field(ge=1, le=100, description="Periods played, the transient's included.")] = 2

    @model_validator(mode="after")
    def _upwards(self) -> Self:
        if self.to_hz <= self.from_hz:
            raise ValueError("to_hz must be above from_hz")
        return self


Segment = Annotated[SineSegment | SweepSegment, Field(discriminator="kind")]


@dataclass(frozen=True, config=STRICT)
class RecordingProtocol:
    """Excitations that `hapteq record` plays one after another into one recording."""

    name: Name
    kind: Literal["recording"]
    title: Annotated[str, Field(min_length=1, max_length=200)]
    segments: Annotated[tuple[Segment, ...], Field(min_length=1, max_length=200)]
    safety: SafetySettings
    source: Annotated[str, Field(max_length=1000, description="Where the numbers come from.")] = ""
    directions: TestDirections = Field(default_factory=TestDirections)
    spring: SpringSettings = Field(default_factory=SpringSettings)
    hand: Annotated[
        Literal["none", "held"],
        Field(description="Whether somebody holds the handle. Nobody by default: only the spring does."),
    ] = "none"
    rest_s: Annotated[float, Field(ge=0.1, le=60, description="Rest before, between and after the excitations.")] = 1.0
    repeats: Annotated[int, Field(ge=1, le=100, description="How often the whole list is played.")] = 1
    fade_s: Annotated[float, Field(gt=0, le=5, description="Every excitation rises and falls over this time.")] = 0.1

    @model_validator(mode="after")
    def _within_caps(self) -> Self:
        for number, segment in enumerate(self.segments, start=1):
            if segment.amplitude_n > self.safety.stimulus_cap_n:
                raise ValueError(
                    f"segment {number} asks for {segment.amplitude_n} N, above safety.stimulus_cap_n "
                    f"({self.safety.stimulus_cap_n} N)"
                )
        return self
