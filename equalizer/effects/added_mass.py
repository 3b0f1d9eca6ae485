"""Added mass: a mass at the handle that the model lacks."""

from dataclasses import replace

import numpy as np

from equalizer.effects.effect import ALL_SITES, Effect, Parameter, Structure, Values
from equalizer.effects.starts.evidence import Evidence
from equalizer.effects.starts.starting_values import PartialRegression, axis_motion, value_along
from equalizer.plant.linear_simulation import driven_axes
from equalizer.plant.mechanical_model import MechanicalModel

_GUESS = 0.1
"""Start value as a share of the model's own mass, used where re-tuning has absorbed the missing mass."""


def _change(model: MechanicalModel, axis: int, values: Values) -> MechanicalModel:
    along = driven_axes(model)[:, axis]
    return replace(model, mass=model.mass + values["mass"] * np.outer(along, along))


def _starts(evidence: Evidence, axis: int) -> tuple[Values, ...]:
    sites = range(evidence.model.inputs) if axis == ALL_SITES else (axis,)
    found = []
    for site in sites:
        motion = axis_motion(evidence, site)
        nuisances = np.column_stack([motion.position, motion.velocity, np.ones_like(motion.force)])
        beside = PartialRegression(motion.force, nuisances)
        found.append(float(beside.fit(-motion.acceleration).strengths[0]))
    known = min(value_along(evidence.model.mass, driven_axes(evidence.model)[:, site]) for site in sites)
    guesses = (float(np.median(found)), _GUESS * known)
    return tuple({"mass": guess} for guess in guesses if guess > 0)


EFFECT = Effect(
    name="added_mass",
    equation="F = -mass dv/dt",
    source="Newton",
    signature="the missing force is a straight line over the acceleration, at every level; nothing appears at silent "
    "lines",
    parameters=(Parameter("mass", 1e-9, 1e6, none=0.0),),
    acts=Structure(_change),
    starts=_starts,
    sites=("all", "one"),
)
