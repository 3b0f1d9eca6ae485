"""Dahl's friction: a bristle that bends as an elastic spring first and slips at the Coulomb level.

P. R. Dahl, "Solid friction damping of mechanical vibrations", AIAA Journal 14(12), 1976. Passive, holds without
creep, and has no corner at zero speed where a simulation at a fixed step would chatter.
"""

from study.devices.simulated.inlined import inlined


@inlined
def bent_bristle(bristle: float, travel: float, longest: float) -> float:
    """The bristle's bend after a `travel`, both rad: dz = dx - |dx| z / longest, solved backwards, so |z| <= longest
    for any step."""
    return (bristle + travel) / (1.0 + abs(travel) / longest)
