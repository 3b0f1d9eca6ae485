"""Hand impedance: a mass, a damper and a spring to the ground along each driven axis of the handle.

    F = -(m dv/dt + c v + k x)        in kg, N s/m, N/m (a rotation: kg m², N m s/rad, N m/rad)

The values are added to the model's mass, damping and stiffness matrices along the axis.
"""

from dataclasses import replace

import numpy as np

from equalizer.effects.effect import Effect, Parameter, Structure, Values
from equalizer.effects.starts.evidence import Evidence
from equalizer.effects.starts.starting_values import PartialRegression, compute_quadratic_form, select_axis_motion
from equalizer.plant.linear_simulation import compute_driven_axes
from equalizer.plant.mechanical_model import MechanicalModel

_INITIAL_SHARE = 0.1
"""Second starting values, as shares of the model's own mass, damping and stiffness. In the first, a tenth of them
replaces each value that the regression finds negative or zero."""


def _change(model: MechanicalModel, axis: int, values: Values) -> MechanicalModel:
    direction = compute_driven_axes(model)[:, axis]
    square = np.outer(direction, direction)
    return replace(
        model,
        mass=model.mass + values["mass"] * square,
        damping=model.damping + values["damping"] * square,
        stiffness=model.stiffness + values["stiffness"] * square,
    )


def _find_starting_values(evidence: Evidence, axis: int) -> tuple[Values, ...]:
    """Values by linear regression of the missing force, then shares of the model's own values."""
    motion = select_axis_motion(evidence, axis)
    regression = PartialRegression(motion.force, np.ones((len(motion.force), 1)))
    estimates = regression.fit(-motion.acceleration, -motion.velocity, -motion.position).strengths.tolist()
    direction, model = compute_driven_axes(evidence.model)[:, axis], evidence.model
    model_shares = [
        _INITIAL_SHARE * compute_quadratic_form(matrix, direction)
        for matrix in (model.mass, model.damping, model.stiffness)
    ]
    values = [
        estimate if estimate > 0 else 0.1 * fallback for estimate, fallback in zip(estimates, model_shares, strict=True)
    ]
    names = ("mass", "damping", "stiffness")
    return tuple(dict(zip(names, numbers, strict=True)) for numbers in (values, model_shares))


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
    action=Structure(_change),
    starts=_find_starting_values,
    sites=("each",),
    simpler=("added_mass", "viscous_damping"),
)
