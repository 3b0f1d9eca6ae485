"""Settings of the apparatus in every protocol: test directions, virtual spring, safety limits.

Each class is a table of the TOML file; Pydantic checks its values. Part of `study_protocol` and `recording_protocol`.
Axes are those of the device: x toward the operator, y to the right, z up, origin at the centre of the workspace.
"""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator
from pydantic.dataclasses import dataclass

from protocols.definition.field_types import MAX_AMPLITUDE_N
from protocols.definition.plausibility import PlausibilitySettings
from protocols.definition.problem import Problem, refuse
from protocols.definition.staircase_rule import STRICT

Plane = Literal["xy", "yz", "zx"]
"""Plane of two device axes. Angles in it are counted from the first axis, positive toward the second."""


@dataclass(frozen=True, config=STRICT)
class TestDirections:
    """Two orthogonal directions in a plane, symmetric about the linkage's line of symmetry in that plane.

    Direction 1 lies at `symmetry_deg` + 45°, direction 2 at `symmetry_deg` - 45°. Orthogonal directions are the
    easiest pair to distinguish, and therefore give the most conservative limit.
    """

    __test__ = False  # pytest collects classes whose names begin with Test

    plane: Plane = Field(
        default="yz",
        description="Plane of both directions. Default 'yz', the frontal plane, in which the picture on the "
        "screen lies too.",
    )
    symmetry_deg: float = Field(
        default=90.0,
        ge=-180,
        le=180,
        description="Angle of the linkage's line of symmetry in the plane, from its first axis. Default 90: with "
        "one leg upright the linkage is symmetric about the vertical.",
    )


@dataclass(frozen=True, config=STRICT)
class SpringSettings:
    """Weak virtual spring and damper towards the centre, which keep the handle where the linkage is symmetric."""

    natural_frequency_hz: float = Field(
        default=3.5,
        ge=0,
        le=10,
        description="Natural frequency with the device's own mass at the handle; 0 = no spring. Default 3.5, as "
        "published for identification: weak, below every tested frequency, and sufficient to keep the handle "
        "central.",
    )
    damping_n_s_per_m: float = Field(
        default=0.0,
        ge=0,
        le=20,
        description="Virtual damping in addition to the spring. Default 0, because the device's own friction "
        "suffices and speeds differentiated from encoder readings are noisy.",
    )


@dataclass(frozen=True, config=STRICT)
class SafetySettings:
    """Limits of force and time that the safety layer (`study.devices.safe`) enforces at every tick, independent
    of the rest of the program."""

    stimulus_cap_n: Annotated[
        float,
        Field(
            gt=0,
            le=MAX_AMPLITUDE_N,
            description="Upper limit of the norm of the stimulus force, without spring and damper; at most 3 N in "
            "any protocol. With spring and damper the command may be larger: see total_cap_n.",
        ),
    ]
    total_cap_n: Annotated[
        float,
        Field(
            gt=0,
            le=6.0,
            description="Upper limit of the norm of the whole command (stimulus, spring and damper), the largest "
            "force on a hand; at most 6 N in any protocol. A command above the cap is scaled down; its direction is "
            "kept.",
        ),
    ]
    feedback_cap_n: float = Field(
        default=1.5,
        gt=0,
        le=6.0,
        description="Upper limit of the norm of the spring's force, of the damper's, and of both together; a value "
        "above total_cap_n has the effect of total_cap_n. Default 1.5, the difference between total and stimulus "
        "cap in the shipped protocols. "
        "Leaning on the spring then never reduces a stimulus, and the pull at a wrong position that is not "
        "detected is limited to it. Measured: 1.35 N.",
    )
    longest_trial_s: float = Field(
        default=120.0,
        gt=0,
        le=600,
        description="A stimulus ends after this time, answered or not; such a trial is void. Default 120: even a "
        "task without a time limit must not hold a force after the participant has left.",
    )
    watchdog_s: float = Field(
        default=0.5,
        ge=0.3,
        le=5,
        description="The force fades to zero when the program sends no sign of life for this time. Default 0.5: "
        "longer than any pause of a busy computer, and short enough not to startle.",
    )
    release_s: float = Field(
        default=0.05, gt=0, le=1, description="Duration of a safety fade. Default 0.05: short, but without a jerk."
    )
    plausibility: PlausibilitySettings = Field(default_factory=PlausibilitySettings)

    @model_validator(mode="after")
    def _require_consistent_caps(self) -> Self:
        """Raise InconsistentError where total_cap_n is below stimulus_cap_n."""
        if self.total_cap_n < self.stimulus_cap_n:
            allowed = f"at least {self.stimulus_cap_n} N, the stimulus_cap_n, with room for the spring"
            refuse([Problem("total_cap_n", f"is {self.total_cap_n} N, below stimulus_cap_n", allowed)])
        return self
