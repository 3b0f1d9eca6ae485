"""Definition of a recording protocol: excitations, their directions, the virtual spring, safety limits and timing.

A protocol file of kind "recording" is read into `RecordingProtocol`, which validates it. Read by
`protocols.document.loading`; `hapteq record` plays it (`study.workflows.recording`).
"""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator
from pydantic.dataclasses import dataclass

from protocols.definition.apparatus import SafetySettings, SpringSettings, TestDirections
from protocols.definition.field_types import MAX_AMPLITUDE_N, Name, Source, Title
from protocols.definition.problem import Problem, refuse
from protocols.definition.recording_segments import Segment
from protocols.definition.staircase_rule import STRICT


@dataclass(frozen=True, config=STRICT)
class RecordingProtocol:
    """Excitations that `hapteq record` plays in sequence into one recording. Raises ValueError for values outside their
    limits."""

    name: Name
    kind: Annotated[
        Literal["recording"], Field(description="Kind of the protocol: a recording, played by `hapteq record`.")
    ]
    title: Title
    segments: Annotated[
        tuple[Segment, ...], Field(min_length=1, max_length=200, description="Excitations, played in this order.")
    ]
    safety: SafetySettings
    source: Source = ""
    directions: TestDirections = Field(default_factory=TestDirections)
    spring: SpringSettings = Field(default_factory=SpringSettings)
    hand: Literal["none", "held"] = Field(
        default="none",
        description="Whether a person holds the handle. Default 'none', because a spring is reproducible and a "
        "grip is not. Only a protocol with 'held' is played into a hand.",
    )
    rest_s: float = Field(
        default=1.0,
        ge=0.1,
        le=60,
        description="Rest before, between and after the excitations. Default 1: vibrations have decayed by then. "
        "The rest also records the sensor's noise.",
    )
    repeats: int = Field(
        default=1,
        ge=1,
        le=100,
        description="Number of times that the whole list is played. Default 1; with more, noise can be "
        "distinguished from the device's response.",
    )
    fade_s: float = Field(
        default=0.1, gt=0, le=5, description="Time over which every excitation rises and falls. Default 0.1: no click."
    )
    lower_on_clip: bool = Field(
        default=True,
        description="Whether an excitation at which the accelerometer or the total force reaches its limit is "
        "played again with a lower amplitude. Default true: clipped samples contain no information about the "
        "device.",
    )
    least_amplitude_n: float = Field(
        default=0.2,
        gt=0,
        le=MAX_AMPLITUDE_N,
        description="Lowest amplitude to which an excitation is reduced. Default 0.2: about the friction of such "
        "a device, below which it hardly moves.",
    )

    @model_validator(mode="after")
    def _require_amplitudes_within_cap(self) -> Self:
        """Raise InconsistentError where the amplitude of a segment (N) is above the cap of the stimulus."""
        cap_n = self.safety.stimulus_cap_n
        refuse(
            [
                Problem(
                    f"segments[{segment_number}].amplitude_n",
                    f"is {segment.amplitude_n} N, above safety.stimulus_cap_n",
                    f"above 0 and at most {cap_n} N, the cap",
                )
                for segment_number, segment in enumerate(self.segments, start=1)
                if segment.amplitude_n > cap_n
            ]
        )
        return self
