"""Viscous damping beyond the model's, as of a bearing, eddy currents, or a motor on a voltage drive."""

from dataclasses import replace

import numpy as np

from equalizer.effects.effect import Effect, Parameter, Structure, Values
from equalizer.effects.starts.evidence import Evidence
from equalizer.effects.starts.starting_values import PartialRegression, axis_motion, value_along
from equalizer.plant.linear_simulation import driven_axes
from equalizer.plant.mechanical_model import MechanicalModel

_GUESS = 0.3
"""Starting value as a share of the model's own damping, used where re-tuning has absorbed the missing damping."""


def _change(model: MechanicalModel, axis: int, values: Values) -> MechanicalModel:
    along = driven_axes(model)[:, axis]
    return replace(model, damping=model.damping + values["damping"] * np.outer(along, along))


def _starts(evidence: Evidence, axis: int) -> tuple[Values, ...]:
    motion = axis_motion(evidence, axis)
    nuisances = np.column_stack([motion.position, motion.acceleration, np.ones_like(motion.position)])
    fit = PartialRegression(motion.force, nuisances).fit(-motion.velocity)
    damping = float(fit.strengths[0])
    known = value_along(evidence.model.damping, driven_axes(evidence.model)[:, axis])
    guesses = (damping, _GUESS * known)
    return tuple({"damping": guess} for guess in guesses if guess > 0)


EFFECT = Effect(
    name="viscous_damping",
    equation="F = -damping v",
    source="Rayleigh's dissipation; eddy currents and back-EMF act alike",
    signature="the missing force is a straight line over the velocity, at every level; nothing appears at silent lines",
    parameters=(Parameter("damping", 1e-9, 1e6, none=0.0),),
    acts=Structure(_change),
    starts=_starts,
)
