"""Hand impedance: a mass, a damper and a spring to the ground along each driven axis of the handle.

    F = -(m dv/dt + c v + k x)        in kg, N s/m, N/m (a rotation: kg m², N m s/rad, N m/rad)

The values are added to the model's mass, damping and stiffness matrices along the axis. An entry of
`equalizer.effects.catalogue`.
"""

from dataclasses import replace

import numpy as np

from equalizer.effects.effect import Effect, Parameter, Structure, Values
from equalizer.effects.starts.evidence import Evidence
from equalizer.effects.starts.starting_values import PartialRegression, compute_quadratic_form, select_axis_motion
from equalizer.plant.linear_simulation import compute_driven_axes
from equalizer.plant.mechanical_model import MechanicalModel

_MODEL_SHARE = 0.1
"""Starting values of the second set, relative to the model's own mass, damping and stiffness along the axis. Chosen."""
_LEAST_ESTIMATE_RATIO = 0.1
"""Starting value of the first set where its estimate is not positive, relative to that of the second set. Chosen."""


def _add_impedance(model: MechanicalModel, axis: int, values: Values) -> MechanicalModel:
    """Add mass, damping and stiffness to the model along a driven axis: `Structure.change` of this effect."""
    direction = compute_driven_axes(model)[:, axis]
    direction_product = np.outer(direction, direction)
    return replace(
        model,
        mass=model.mass + values["mass"] * direction_product,
        damping=model.damping + values["damping"] * direction_product,
        stiffness=model.stiffness + values["stiffness"] * direction_product,
    )


def _find_starting_values(evidence: Evidence, axis: int) -> tuple[Values, ...]:
    """Find two sets of starting values: by linear regression of the missing force, and as a share of the model's own
    mass, damping and stiffness (`_MODEL_SHARE`)."""
    motion = select_axis_motion(evidence, axis)
    regression = PartialRegression(motion.force, np.ones((len(motion.force), 1)))
    estimates = regression.fit(-motion.acceleration, -motion.velocity, -motion.position).strengths.tolist()
    direction, model = compute_driven_axes(evidence.model)[:, axis], evidence.model
    model_shares = [
        _MODEL_SHARE * compute_quadratic_form(matrix, direction)
        for matrix in (model.mass, model.damping, model.stiffness)
    ]
    positive_estimates = [
        estimate if estimate > 0 else _LEAST_ESTIMATE_RATIO * model_share
        for estimate, model_share in zip(estimates, model_shares, strict=True)
    ]
    return tuple(
        dict(zip(("mass", "damping", "stiffness"), values, strict=True))
        for values in (positive_estimates, model_shares)
    )


EFFECT = Effect(
    name="hand_impedance",
    equation="F = -(mass dv/dt + damping v + stiffness x), along each axis",
    source="Hasser and Cutkosky 2002, Haptics Symposium: a pinched knob as mass, damper and spring",
    signature="the device is heavier, more damped and stiffer than the model along every axis, at every level; nothing "
    "appears at silent lines",
    parameters=(
        # Not on a log scale: the response is almost linear in these values, and a fit may reach zero and return.
        Parameter("mass", 0.0, 1e6, none=0.0, scale="signed"),
        Parameter("damping", 0.0, 1e6, none=0.0, scale="signed"),
        Parameter("stiffness", 0.0, 1e9, none=0.0, scale="signed"),
    ),
    action=Structure(_add_impedance),
    starts=_find_starting_values,
    sites=("each",),
    simpler=("added_mass", "viscous_damping"),
)
