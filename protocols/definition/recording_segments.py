"""Excitation segments of a recording protocol: sinusoids, swept sines, multisines.

Each class is a table of the TOML file; Pydantic checks its values. Part of `recording_protocol`; the signals are made
by `study.session.stimulus.recording_pieces`.
"""

import math
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator
from pydantic.dataclasses import dataclass

from protocols.definition.field_types import MAX_AMPLITUDE_N, Frequency, SineFrequency
from protocols.definition.problem import Problem, refuse
from protocols.definition.staircase_rule import STRICT

Amplitude = Annotated[float, Field(gt=0, le=MAX_AMPLITUDE_N, description="Peak of the force, in newtons.")]
"""Peak of an excitation in newtons; 3 N is the safety limit of a stimulus with a hand (docs/safety.md)."""
AxisName = Annotated[
    Literal["x", "y", "z", "direction_1", "direction_2"],
    Field(description="A device axis, or one of the two test directions."),
]
Period = Annotated[float, Field(gt=0, le=600, description="One period.")]
"""Duration of a period in seconds. The upper limits of this module are chosen, except 3 N."""
Periods = Annotated[
    int,
    Field(
        ge=1,
        le=100,
        description="Number of periods, the transient's included. Default 2: one for the transient, one for "
        "evaluation.",
    ),
]
Role = Annotated[
    Literal["fit", "test", ""],
    Field(
        description="Use of the excitation: 'fit' a model, or 'test' it on data that the fit has not used. "
        "Default: empty, decided when the recording is used."
    ),
]


@dataclass(frozen=True, config=STRICT)
class SineSegment:
    """Sinusoids in sequence, each with a time to settle before its evaluated part."""

    kind: Annotated[Literal["sine"], Field(description="Sinusoids, one after another.")]
    frequencies_hz: Annotated[
        tuple[SineFrequency, ...],
        Field(min_length=1, max_length=100, description="Frequencies, played in this order."),
    ]
    amplitude_n: Amplitude
    along: AxisName
    duration_s: Annotated[float, Field(gt=0, le=600, description="Evaluated part of every sinusoid; whole periods.")]
    settle_s: float = Field(
        default=1.0,
        ge=0,
        le=60,
        description="Time that each sinusoid is played before the evaluated part. Default 1: resonances have "
        "decayed by then.",
    )
    role: Role = ""


@dataclass(frozen=True, config=STRICT)
class SweepSegment:
    """A periodic logarithmic swept sine; the transient decays during the first period."""

    kind: Annotated[Literal["sweep"], Field(description="A logarithmic swept sine.")]
    from_hz: Annotated[Frequency, Field(description="Lowest frequency, where every period begins.")]
    to_hz: Annotated[Frequency, Field(description="Highest frequency, where every period ends.")]
    amplitude_n: Amplitude
    along: AxisName
    duration_s: Period
    periods: Periods = 2
    role: Role = ""

    @model_validator(mode="after")
    def _require_rising_sweep(self) -> Self:
        """Raise InconsistentError unless the frequency rises and a period of the sweep contains at least one cycle."""
        _require_rising_band(self.from_hz, self.to_hz)
        # A logarithmic sweep of T seconds from f1 to f2 contains T (f2 - f1) / ln(f2 / f1) cycles.
        shortest_period_s = math.log(self.to_hz / self.from_hz) / (self.to_hz - self.from_hz)
        problem_text = f"is {self.duration_s} s, less than a cycle of the sweep"
        allowed = f"{math.ceil(1e6 * shortest_period_s) / 1e6:g} s or more"
        refuse([] if self.duration_s >= shortest_period_s else [Problem("duration_s", problem_text, allowed)])
        return self


@dataclass(frozen=True, config=STRICT)
class MultisineSegment:
    """A periodic sum of sinusoids of equal amplitude and random phases, at multiples of 1 / duration_s.

    These multiples are its lines. With odd lines only, the even lines of the response contain noise and even distortion
    alone. Periods differ in noise only; realisations differ in their phases, and therefore in odd distortion.
    """

    kind: Annotated[Literal["multisine"], Field(description="A sum of sinusoids with random phases.")]
    from_hz: Annotated[Frequency, Field(description="Lower limit of the lines' frequencies.")]
    to_hz: Annotated[Frequency, Field(description="Upper limit of the lines' frequencies.")]
    amplitude_n: Annotated[
        float,
        Field(
            gt=0,
            le=MAX_AMPLITUDE_N,
            description="Peak of the force, in newtons; along all axes, peak of the force's norm.",
        ),
    ]
    along: Annotated[
        Literal["x", "y", "z", "direction_1", "direction_2", "all"],
        Field(
            description="A device axis, a test direction, or 'all' three axes at once, each with its own phases. "
            "Three realisations along all axes are orthogonal, so that axes can be distinguished at every line."
        ),
    ]
    duration_s: Annotated[float, Field(gt=0, le=600, description="One period: lines lie 1 / duration_s apart.")]
    periods: Periods = 2
    odd_only: bool = Field(
        default=True,
        description="Whether only odd multiples of 1 / duration_s are excited. Default true: even distortion "
        "then falls between the lines.",
    )
    seed: int = Field(
        default=1, ge=0, le=2**53, description="Seed of the phases; the same seed gives the same excitation. Default 1."
    )
    realisations: int = Field(
        default=1,
        ge=1,
        le=50,
        description="Number of excitations with different phases. Default 1; with more, distortion can be "
        "distinguished from the linear response.",
    )
    role: Role = ""

    @model_validator(mode="after")
    def _require_lines(self) -> Self:
        """Raise InconsistentError where to_hz is not above from_hz, or no line lies between them, both included."""
        _require_rising_band(self.from_hz, self.to_hz)
        # 1e-9 of a line absorbs the rounding error of a limit that is itself a line.
        first_line, last_line = (
            math.ceil(self.from_hz * self.duration_s - 1e-9),
            math.floor(self.to_hz * self.duration_s + 1e-9),
        )
        # Of two adjacent lines one is odd, so that it suffices to examine the first two.
        lines = [
            line for line in range(first_line, min(last_line, first_line + 1) + 1) if line % 2 or not self.odd_only
        ]
        line_spacing_hz = (2 if self.odd_only else 1) / self.duration_s
        allowed = f"a period with lines between from_hz and to_hz, which lie {line_spacing_hz:g} Hz apart here"
        refuse([] if lines else [Problem("duration_s", f"is {self.duration_s} s, too short for the band", allowed)])
        return self


Segment = Annotated[SineSegment | SweepSegment | MultisineSegment, Field(discriminator="kind")]
"""A segment of any kind, chosen by its key `kind`."""


def find_highest_hz(segment: SineSegment | SweepSegment | MultisineSegment) -> float:
    """Find the highest frequency of the excitation (Hz); for a sweep or multisine, the upper limit `to_hz`."""
    return max(segment.frequencies_hz) if isinstance(segment, SineSegment) else segment.to_hz


def _require_rising_band(from_hz: float, to_hz: float) -> None:
    """Raise InconsistentError unless from_hz is below to_hz."""
    if to_hz <= from_hz:
        refuse([Problem("to_hz", f"is {to_hz} Hz, not above from_hz", f"above {from_hz} Hz, the from_hz")])
