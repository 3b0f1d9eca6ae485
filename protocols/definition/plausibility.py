"""Bounds of plausible position readings of the handle. A reading beyond them is a sensor fault: the force is released.

`study/devices/governor` checks them at every tick. A bound that is too narrow ends valid trials. One that is too wide
lets the virtual spring and damper respond to a false position with a force, up to the limit of the feedback force.
"""

from dataclasses import asdict

from pydantic import Field
from pydantic.dataclasses import dataclass

from protocols.definition.staircase_rule import STRICT


@dataclass(frozen=True, config=STRICT)
class PlausibilitySettings:
    """Bounds of the position readings (table `safety.plausibility` of a protocol). Each default is several times what a
    hand and the forces of the shipped protocols cause. "Largest measured" in a description: the maximum on the
    simulated omega.3 over all shipped protocols, with and without a hand."""

    workspace_m: float = Field(
        default=0.12,
        gt=0,
        le=0.5,
        description="Largest distance from the device's origin. Default 0.12: an omega.3 reaches 0.08 m, and a "
        "larger device needs more.",
    )
    fastest_m_per_s: float = Field(
        default=3.0,
        gt=0,
        le=20,
        description="Largest speed from one reading to the next. Default 3: without friction, 6 N (the highest "
        "cap) accelerates 0.25 kg to 2.7 m/s over the whole workspace; fingers reach about 1 m/s. Largest "
        "measured: 0.3.",
    )
    longest_jump_m: float = Field(
        default=0.05,
        gt=0,
        le=0.5,
        description="Largest distance between two successive readings, however late the second is. Default 0.05: "
        "0.5 m/s over 0.1 s, the longest gap after which a loop continues. Largest measured: 0.0003 per tick.",
    )
    acceleration_mps2: float = Field(
        default=500.0,
        gt=0,
        le=10000,
        description="Largest acceleration of the readings, averaged over 20 ms so that an impact on a stop stays "
        "below it. Default 500: twice the acceleration of 0.2 kg by 50 N from a hand. Largest measured: 60, "
        "steps of the encoders included.",
    )
    resolution_m: float = Field(
        default=1e-5,
        ge=1e-7,
        le=0.001,
        description="Resolution of the encoders at the handle; a difference below half of it counts as no "
        "change. Default 0.00001, from the omega.3's data sheet.",
    )
    friction_n: float = Field(
        default=0.5,
        ge=0,
        le=3,
        description="Changes of force below twice this value need not move the handle. Default 0.5: more than "
        "twice the friction of the simulated omega.3, and more than the friction of such devices.",
    )
    stale_s: float = Field(
        default=0.1,
        gt=0,
        le=5,
        description="Time after which an unchanged position is stale, although the force must have moved even a "
        "firmly gripped handle (1 kg, 60 N s/m, 3000 N/m) by twice the resolution. Default 0.1: from 2 Hz on, a "
        "handle that sticks at its turning points rests for less than this.",
    )
    still_s: float = Field(
        default=1.0,
        gt=0,
        le=60,
        description="Longest time for which the spring may pull with more than friction_n at a position that "
        "does not change. In the second half of this time the pull is faded out. A hand that rested on the "
        "spring then moves; a position that has still not changed is stale. Default 1.",
    )


PLAUSIBILITY_DEFAULTS = asdict(PlausibilitySettings())
"""The default values. A protocol with these values has the same hash as one without this table."""
