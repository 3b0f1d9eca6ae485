"""Settings of probes: short known forces, played between trials, that measure how device and grip change in a session.

A probe is a multisine on all three axes. It shows the response of the device with the hand; a reference, played without
a hand, shows that of the device alone. The settings are the table `probes` of a `StudyProtocol`;
`study.session.stimulus.probe_stimulus` computes the forces.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Self

from pydantic import Field, model_validator
from pydantic.dataclasses import dataclass

from protocols.definition.problem import Problem, refuse
from protocols.definition.staircase_rule import STRICT

if TYPE_CHECKING:
    from protocols.definition.study_protocol import StudyProtocol

LEAST_REFERENCE_TO_HZ = 45.0
"""Least `to_hz` with a reference: several lines above 30 Hz are needed to recognise whether the handle is free.
Chosen."""

PERIOD_S = 1.0
"""Period (s) of a probe's multisine: its odd lines are 2 Hz apart, and each of them drives a single axis."""

FADE_S = 0.25
"""Duration of a probe's raised-cosine fade at both ends (s). Chosen: long enough that the onset excites few modes."""

PROBE_HOLD_S = FADE_S + PERIOD_S + 0.1
"""Time from the start of a probe to its fade-out (s): fade-in, one whole period, and a margin of 0.1 s (chosen)."""

LOWEST_LINE_HZ = 3.0
"""Lowest line (Hz): below it, the acceleration due to forces that are hardly felt is below the sensor's noise.
Chosen."""

LevelN = Annotated[float, Field(gt=0, le=1.5)]
"""Peak force of a probe, N; its upper limit is chosen by hand."""


@dataclass(frozen=True, config=STRICT)
class ProbeSettings:
    """Settings of probes and references: odd multisines on all three axes at once, which the participant is not asked
    about."""

    levels_n: tuple[LevelN, ...] = Field(
        default=(),
        max_length=6,
        description="Peak forces of the probes with a hand on the handle, in newtons, played in turn. Three "
        "levels, such as [0.2, 0.4, 0.8], distinguish friction from damping by the level dependence of the "
        "response. Default: none, and no probe is played between trials.",
    )
    probe_cap_n: float = Field(
        default=1.0,
        gt=0,
        le=1.5,
        description="Upper limit of the probes with a hand on the handle; below staircase.cap_n. Default 1.",
    )
    interval_s: float = Field(
        default=60.0, ge=15, le=3600, description="Shortest time from one probe to the next. Default 60: once a minute."
    )
    to_hz: float = Field(
        default=60.0,
        ge=20,
        le=150,
        description="Upper limit of the frequencies of the lines; at least 45 with a reference. Default 60.",
    )
    reference_s: float = Field(
        default=0.0,
        ge=0,
        le=120,
        description="Length of the reference, a probe without a hand on the handle. It is played at the start of "
        "a sitting and after long pauses. 20 suffices. Default 0: no reference.",
    )
    reference_n: float = Field(
        default=1.0, gt=0, le=1.5, description="Peak force of the reference; not above staircase.cap_n. Default 1."
    )
    reference_after_pause_s: float = Field(
        default=120.0,
        ge=0,
        le=36000,
        description="Length of a pause from which on another reference follows. Default 120.",
    )

    @model_validator(mode="after")
    def _check_limits(self) -> Self:
        """Check levels against their cap, and the settings that a reference needs. Raises InconsistentError."""
        if self.levels_n and max(self.levels_n) > self.probe_cap_n:
            violation = f"holds {max(self.levels_n):g} N, above probe_cap_n"
            refuse([Problem("levels_n", violation, f"at most {self.probe_cap_n:g} N each")])
        if self.reference_s and not self.levels_n:
            violation = (
                "is set without levels_n: only by comparison with a probe with a hand can a free handle be recognised"
            )
            refuse([Problem("reference_s", violation, "0, or levels_n in addition")])
        if self.reference_s and self.to_hz < LEAST_REFERENCE_TO_HZ:
            violation = f"is {self.to_hz:g} Hz: too low to see by a probe whether the handle is free for the reference"
            refuse([Problem("to_hz", violation, f"at least {LEAST_REFERENCE_TO_HZ:g} Hz, or reference_s = 0")])
        return self

    @property
    def is_enabled(self) -> bool:
        """Whether probes are played, with or without references."""
        return bool(self.levels_n)


def find_probe_contradictions(protocol: StudyProtocol) -> list[Problem]:
    """Find contradictions of the probes with other settings of the protocol: a cap not below that of the trials, a
    reference force above it, a slope above the slew limit, and kept recordings that are shorter than a period. Empty
    where no probes are played."""
    probes, cap_n = protocol.probes, protocol.staircase.cap_n
    if not probes.is_enabled:
        return []
    problems = []
    if probes.probe_cap_n >= cap_n:
        violation = f"is {probes.probe_cap_n:g} N, not below staircase.cap_n"
        problems.append(Problem("probes.probe_cap_n", violation, f"less than {cap_n:g} N"))
    if probes.reference_s and probes.reference_n > cap_n:
        violation = f"is {probes.reference_n:g} N, above staircase.cap_n"
        problems.append(Problem("probes.reference_n", violation, f"at most {cap_n:g} N"))
    if protocol.measurement.keep_s < PERIOD_S:
        violation = f"is {protocol.measurement.keep_s:g} s, less than the period of a probe"
        problems.append(Problem("measurement.keep_s", violation, f"at least {PERIOD_S:g} s"))
    # The slope of a multisine is below 2 pi f_max sqrt(2) peak (`MULTISINE_PEAK_FACTOR` in
    # `study.session.stimulus.limits`); the slew limit permits at least that of the steepest stimulus, 2 pi f cap.
    largest_force_n = max((*probes.levels_n, probes.reference_n if probes.reference_s else 0.0))
    highest_allowed_hz = cap_n * max(protocol.all_frequencies_hz, default=0.0) / (math.sqrt(2) * largest_force_n)
    if probes.to_hz > highest_allowed_hz:
        violation = (
            f"is {probes.to_hz:g} Hz: at {largest_force_n:g} N a probe might change faster than the steepest stimulus"
        )
        problems.append(
            Problem("probes.to_hz", violation, f"at most {math.floor(highest_allowed_hz):g} Hz, or lower forces")
        )
    return problems
