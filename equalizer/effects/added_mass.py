"""Added mass: a mass at the handle, such as a tool or a grip, that the model lacks.

    F = -m dv/dt        m > 0 in kg (a rotation: kg m²)

It is added to the mass matrix along the driven axis: M + m a aᵀ, a the axis's unit vector. The limits of m, 1e-9 and
1e6, only keep a fit positive and finite.
"""

from dataclasses import replace

import numpy as np

from equalizer.effects.effect import ALL_SITES, Effect, Parameter, Structure, Values
from equalizer.effects.starts.evidence import Evidence
from equalizer.effects.starts.starting_values import PartialRegression, compute_quadratic_form, select_axis_motion
from equalizer.plant.linear_simulation import compute_driven_axes
from equalizer.plant.mechanical_model import MechanicalModel

_INITIAL_MASS_SHARE = 0.1
"""Second starting value, as a share of the model's own mass (over all axes: the smallest), because re-tuning may have
absorbed the missing mass. Chosen."""


def _add_mass(model: MechanicalModel, axis: int, values: Values) -> MechanicalModel:
    """Add the mass to the model along a driven axis: `Structure.change` of this effect."""
    direction = compute_driven_axes(model)[:, axis]
    return replace(model, mass=model.mass + values["mass"] * np.outer(direction, direction))


def _find_starting_values(evidence: Evidence, axis: int) -> tuple[Values, ...]:
    """Find the mass by linear regression of the missing force on -dv/dt, with position, velocity and a constant as
    nuisances (the median over all axes for ALL_SITES); then a share of the model's mass. Only positive values."""
    sites = range(evidence.model.inputs) if axis == ALL_SITES else (axis,)
    estimates = []
    for site in sites:
        motion = select_axis_motion(evidence, site)
        nuisances = np.column_stack([motion.position, motion.velocity, np.ones_like(motion.force)])
        regression = PartialRegression(motion.force, nuisances)
        estimates.append(float(regression.fit(-motion.acceleration).strengths[0]))
    model_mass = min(
        compute_quadratic_form(evidence.model.mass, compute_driven_axes(evidence.model)[:, site]) for site in sites
    )
    candidates = (float(np.median(estimates)), _INITIAL_MASS_SHARE * model_mass)
    return tuple({"mass": mass} for mass in candidates if mass > 0)


EFFECT = Effect(
    name="added_mass",
    equation="F = -mass dv/dt",
    source="Newton",
    signature="the missing force is a straight line over the acceleration, at every level; nothing appears at silent "
    "lines",
    parameters=(Parameter("mass", 1e-9, 1e6, none=0.0),),
    action=Structure(_add_mass),
    starts=_find_starting_values,
    sites=("all", "one"),
)
