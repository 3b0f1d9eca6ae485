"""Hand impedance: a mass, a damper and a spring to the ground along each driven axis of the handle.

    F = -(m dv/dt + c v + k x)        in kg, N s/m, N/m (a rotation: kg m², N m s/rad, N m/rad)

The values are added to the model's mass, damping and stiffness matrices along the axis.
"""

from dataclasses import replace

import numpy as np

from equalizer.effects.effect import Effect, Parameter, Structure, Values
from equalizer.effects.starts.evidence import Evidence
from equalizer.effects.starts.starting_values import PartialRegression, axis_motion, value_along
from equalizer.plant.linear_simulation import driven_axes
from equalizer.plant.mechanical_model import MechanicalModel

_GUESS = 0.1
"""Second starting values, as shares of the model's own mass, damping and stiffness. In the first, a tenth of them
replaces each value that the regression finds negative or zero."""


def _change(model: MechanicalModel, axis: int, values: Values) -> MechanicalModel:
    along = driven_axes(model)[:, axis]
    square = np.outer(along, along)
    return replace(
        model,
        mass=model.mass + values["mass"] * square,
        damping=model.damping + values["damping"] * square,
        stiffness=model.stiffness + values["stiffness"] * square,
    )


def _starts(evidence: Evidence, axis: int) -> tuple[Values, ...]:
    """Values by linear regression of the missing force, then shares of the model's own values."""
    motion = axis_motion(evidence, axis)
    beside = PartialRegression(motion.force, np.ones((len(motion.force), 1)))
    found = beside.fit(-motion.acceleration, -motion.velocity, -motion.position).strengths.tolist()
    along, model = driven_axes(evidence.model)[:, axis], evidence.model
    known = [_GUESS * value_along(matrix, along) for matrix in (model.mass, model.damping, model.stiffness)]
    values = [each if each > 0 else 0.1 * other for each, other in zip(found, known, strict=True)]
    names = ("mass", "damping", "stiffness")
    return tuple(dict(zip(names, numbers, strict=True)) for numbers in (values, known))


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
    acts=Structure(_change),
    starts=_starts,
    sites=("each",),
    simpler=("added_mass",),
)
