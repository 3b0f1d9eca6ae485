"""Settings of the apparatus that every protocol shares: directions, spring, limits.

Axes are those of the device: x toward the operator, y to the right, z up, origin at the centre of the workspace.
"""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator
from pydantic.dataclasses import dataclass

from protocols.definition.plausibility import PlausibilitySettings
from protocols.definition.problem import Problem, refuse
from protocols.definition.staircase_rule import STRICT

Plane = Literal["xy", "yz", "zx"]


@dataclass(frozen=True, config=STRICT)
class TestDirections:
    """Two orthogonal directions in a plane, mirrored about the linkage's line of symmetry in that plane.

    Direction 1 lies 45° counter-clockwise of the line, direction 2 as far clockwise: orthogonal, because that is
    the easiest pair to tell apart and so the most conservative limit.
    """

    __test__ = False  # a test direction is not a test

    plane: Annotated[
        Plane,
        Field(
            description="The plane of both directions. Default 'yz', the frontal plane, because the picture on "
            "the screen lies in it too."
        ),
    ] = "yz"
    symmetry_deg: Annotated[
        float,
        Field(
            ge=-180,
            le=180,
            description="Angle of the linkage's line of symmetry in the plane, from its first axis. Default 90, "
            "because with one leg upright the linkage mirrors left and right about the vertical.",
        ),
    ] = 90.0


@dataclass(frozen=True, config=STRICT)
class SpringSettings:
    """A weak virtual spring about the centre, which keeps the handle where the linkage is symmetric."""

    natural_frequency_hz: Annotated[
        float,
        Field(
            ge=0,
            le=10,
            description="Natural frequency with the device's own mass at the handle; 0 = no spring. Default 3.5, as "
            "published for identification: weak, below every frequency tested, and it keeps the handle central.",
        ),
    ] = 3.5
    damping_n_s_per_m: Annotated[
        float,
        Field(
            ge=0,
            le=20,
            description="Virtual damping in addition to the spring. Default 0, because the device's own friction is "
            "enough and differentiated encoders are noisy.",
        ),
    ] = 0.0


@dataclass(frozen=True, config=STRICT)
class SafetySettings:
    """Limits that the safety layer keeps at every tick, independent of the rest of the program."""

    stimulus_cap_n: Annotated[
        float,
        Field(
            gt=0,
            le=3.0,
            description="Norm of the stimulus force, spring and damper not counted; 3 N at the most in any "
            "protocol. Together with them the command may be larger: see total_cap_n.",
        ),
    ]
    total_cap_n: Annotated[
        float,
        Field(
            gt=0,
            le=6.0,
            description="Norm of the whole command: stimulus, spring and damper. This is what a hand may feel; 6 N "
            "at the most in any protocol. At the cap the direction of the force is kept.",
        ),
    ]
    feedback_cap_n: Annotated[
        float,
        Field(
            gt=0,
            le=6.0,
            description="Norm of the spring's force, of the damper's, and of both together; never above "
            "total_cap_n. Default 1.5: the room that the shipped protocols leave between stimulus and total, so "
            "that leaning on the spring never reduces a stimulus, and the pull at a wrong position that is not "
            "detected is limited to it. Measured: 1.35 N.",
        ),
    ] = 1.5
    longest_trial_s: Annotated[
        float,
        Field(
            gt=0,
            le=600,
            description="A stimulus is released after this time, answered or not; such a trial is void. Default 120, "
            "because a task without a time limit must still not hold a force after the participant has left.",
        ),
    ] = 120.0
    watchdog_s: Annotated[
        float,
        Field(
            ge=0.3,
            le=5,
            description="The force fades to zero when the program gives no sign of life for this time. Default 0.5: "
            "longer than any pause of a busy computer, and short enough not to frighten.",
        ),
    ] = 0.5
    release_s: Annotated[
        float,
        Field(gt=0, le=1, description="Duration of a fade for safety. Default 0.05: short, but without a jerk."),
    ] = 0.05
    plausibility: PlausibilitySettings = Field(default_factory=PlausibilitySettings)

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if self.total_cap_n < self.stimulus_cap_n:
            allowed = f"at least {self.stimulus_cap_n} N, the stimulus_cap_n, with room for the spring"
            refuse([Problem("total_cap_n", f"is {self.total_cap_n} N, below stimulus_cap_n", allowed)])
        return self
