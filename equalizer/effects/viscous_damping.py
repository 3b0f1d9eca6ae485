"""Viscous damping in addition to the model's, F = -damping v, as of a bearing, eddy currents, or a motor on a voltage
drive (back-EMF).

`damping` is in N s/m (N m s/rad in a rotational model); v is the velocity along a driven axis d, so that the damping
matrix grows by damping d d'. An entry of `equalizer.effects.catalogue`.
"""

from dataclasses import replace

import numpy as np

from equalizer.effects.effect import Effect, Parameter, Structure, Values
from equalizer.effects.starts.evidence import Evidence
from equalizer.effects.starts.starting_values import PartialRegression, compute_quadratic_form, select_axis_motion
from equalizer.plant.linear_simulation import compute_driven_axes
from equalizer.plant.mechanical_model import MechanicalModel

_INITIAL_DAMPING_SHARE = 0.3
"""Second starting value, relative to the model's own damping along the axis, for a missing damping that re-tuning has
absorbed. Chosen."""


def _add_damping(model: MechanicalModel, axis: int, values: Values) -> MechanicalModel:
    """Add damping d d' to the damping matrix of the model, d the unit vector of the driven axis."""
    direction = compute_driven_axes(model)[:, axis]
    return replace(model, damping=model.damping + values["damping"] * np.outer(direction, direction))


def _find_starting_values(evidence: Evidence, axis: int) -> tuple[Values, ...]:
    """Find starting values: the damping by regression of the missing force on -v, with position, acceleration and a
    constant projected out, then `_INITIAL_DAMPING_SHARE` of the model's; those that are not positive are left out."""
    motion = select_axis_motion(evidence, axis)
    projected_regressors = np.column_stack([motion.position, motion.acceleration, np.ones_like(motion.position)])
    fit = PartialRegression(motion.force, projected_regressors).fit(-motion.velocity)
    regressed_damping = float(fit.strengths[0])
    model_damping = compute_quadratic_form(evidence.model.damping, compute_driven_axes(evidence.model)[:, axis])
    candidates = (regressed_damping, _INITIAL_DAMPING_SHARE * model_damping)
    return tuple({"damping": damping} for damping in candidates if damping > 0)


EFFECT = Effect(
    name="viscous_damping",
    equation="F = -damping v",
    source="Rayleigh's dissipation; eddy currents and back-EMF act alike",
    signature="the missing force is a straight line over the velocity, at every level; nothing appears at silent lines",
    parameters=(Parameter("damping", 1e-9, 1e6, none=0.0),),
    action=Structure(_add_damping),
    starts=_find_starting_values,
)
