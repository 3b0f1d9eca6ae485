"""Constant force along a driven axis, such as weight or the pull of a cable.

    F = force        in N (a rotation: N m), of either sign

It shifts the equilibrium position; a linear model keeps its resonances.
"""

import numpy as np

from equalizer.effects.effect import AxisForce, Effect, Parameter, Values, pack_values
from equalizer.effects.simulation.mechanism_kernel import compile_law
from equalizer.effects.starts.evidence import Evidence
from equalizer.effects.starts.starting_values import PartialRegression, select_axis_motion, stack_linear_regressors
from equalizer.signals.signal import FloatArray


@compile_law
def _compute_mean_force(parameters: FloatArray, memory: FloatArray, step_motion: FloatArray) -> float:
    """Return the force (N), the same at every instant. parameters: force; memory and motion are not used."""
    return float(parameters[0])


def _find_starting_values(evidence: Evidence, axis: int) -> tuple[Values, ...]:
    """Find two starting values: the mean of the missing force, and the constant of its regression on position, velocity
    and acceleration; a value of zero is left out."""
    motion = select_axis_motion(evidence, axis)
    # Re-tuning of a linear model can change its stiffness but not its equilibrium: a constant is no nuisance here.
    regression = PartialRegression(motion.force, stack_linear_regressors(motion, constant=False))
    regressed_force = float(regression.fit(np.ones_like(motion.force)).strengths[0])
    mean_force = float(np.mean(motion.force))
    return tuple({"force": force} for force in (mean_force, regressed_force) if force != 0)


EFFECT = Effect(
    name="constant_force",
    equation="F = force",
    source="weight, or the pull of a cable",
    signature="the missing force is the same everywhere and at every level; the place of rest is another",
    parameters=(Parameter("force", -1e6, 1e6, none=0.0, scale="signed"),),
    action=AxisForce(_compute_mean_force, pack_values("force")),
    starts=_find_starting_values,
)
