"""An elastic joint between what the commands push and what the sensors sit on: cables, belts, a flexible link.

From force to response only the whole mass and the joint's resonance are seen, not how the mass is shared between its
sides: half each is taken, which leaves the resonance and everything below it as it is.
"""

from dataclasses import replace

import numpy as np

from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.signal import FloatArray

DRIVEN_SHARE = 0.5
"""Of the mass that is no oscillator's."""


def across_joint(model: MechanicalModel, m: int, stiffness: FloatArray, loss_s: float) -> MechanicalModel:
    """The driven axes, the axes beyond the joint, oscillators relative to these. model: of the driven axes and
    oscillators relative to them. stiffness: (m, m), positive definite. loss_s: the joint's damping over its stiffness.

    Dampers and springs to the ground stay on the driven axes, where the drives are."""
    participation = model.mass[m:, :m]
    rest = model.mass[:m, :m] - participation.T @ participation
    n = model.coordinates + m
    mass, damping, springs = np.zeros((n, n)), np.zeros((n, n)), np.zeros((n, n))
    mass[m:, m:] = model.mass
    mass[m : 2 * m, m : 2 * m] -= DRIVEN_SHARE * rest
    mass[:m, :m] = DRIVEN_SHARE * rest
    for whole, part in ((damping, model.damping), (springs, model.stiffness)):
        whole[:m, :m] = part[:m, :m]
        whole[2 * m :, 2 * m :] = part[m:, m:]
    for whole, part in ((damping, loss_s * stiffness), (springs, stiffness)):
        whole[: 2 * m, : 2 * m] += np.block([[part, -part], [-part, part]])
    return replace(
        model,
        mass=mass,
        damping=damping,
        stiffness=springs,
        input=np.vstack([model.input[:m], np.zeros((n - m, m))]),
        output=np.hstack([np.zeros((model.outputs, m)), model.output]),
    )
