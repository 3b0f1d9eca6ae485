"""A bolted joint that is loose: within a gap it only rubs, beyond it is stiff."""

import numpy as np

from equalizer.effects.effect import Effect, JointForce, Parameter, Values
from equalizer.effects.evidence import Evidence
from equalizer.effects.instant import V_FREE, V_PER_N, X_FREE, X_PER_N, X
from equalizer.effects.mechanism_kernel import compiled_law
from equalizer.effects.starting_values import own
from equalizer.plant.linear_simulation import driven_axes
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.signal import FloatArray

STEPS = 8
"""Per sample."""


@compiled_law
def _law(of: FloatArray, memory: FloatArray, at: FloatArray) -> float:
    """The spring beyond the gap, between its force at the step's start and end; then what friction can stop."""
    half, stiffness, slip = 0.5 * of[0], of[1], of[2]
    spring = 0.0
    for way in (1.0, -1.0):
        start, end = max(way * at[X] - half, 0.0), way * at[X_FREE] - half
        if start > 0 or end > 0:
            push = 0.5 * stiffness * (start + end) / (1 + 0.5 * stiffness * at[X_PER_N])
            if end - at[X_PER_N] * push < 0:
                push = 0.5 * stiffness * start
            spring = -way * max(push, 0.0)
            break
    stopping = -(at[V_FREE] + at[V_PER_N] * spring) / at[V_PER_N]
    return float(spring + min(max(stopping, -slip), slip))


def joint_at(model: MechanicalModel, axis: int) -> FloatArray:
    """(n,): how a joint near a driven axis moves: against the body that hangs on it by the strongest spring, or against
    the ground where nothing hangs on it."""
    along, axes = driven_axes(model)[:, axis], driven_axes(model)
    carried = np.linalg.norm(axes, axis=1) < 1e-9
    if not carried.any():
        return along
    pull = np.where(carried, np.abs(model.stiffness @ along), 0.0)
    body = int(np.argmax(pull))
    held = float(model.stiffness[body, body])
    if pull[body] == 0 or held <= 0:
        return along
    follows = np.where(carried, 0.0, -model.stiffness[body] / held)
    follows[body] = -1.0
    return np.asarray(follows)


def _change(model: MechanicalModel, axis: int, values: Values) -> tuple[MechanicalModel, FloatArray]:
    return model, joint_at(model, axis)


def _pack(model: MechanicalModel, axis: int, values: Values) -> FloatArray:
    return np.array([values["gap"], values["stiffness"], values["slip"]])


def _starts(evidence: Evidence, axis: int) -> tuple[Values, ...]:
    """By the axis's own motion: nobody measured the joint's."""
    joint = joint_at(evidence.model, axis)
    held = own(evidence.model.stiffness, joint) / float(joint @ joint)
    used = evidence.used > 0
    force, travel = evidence.axis_force[used, axis], evidence.axis_position[used, axis]
    slip, way = float(np.median(np.abs(force))), _travel_in_joint(evidence, axis, joint, float(np.std(travel)))
    stiffness = abs(held) if held != 0 else float(np.std(force)) / max(float(np.std(travel)), 1e-12)
    return tuple({"gap": way * share, "stiffness": 0.3 * stiffness, "slip": slip} for share in (0.5, 2.0))


def _travel_in_joint(evidence: Evidence, axis: int, joint: FloatArray, travel: float) -> float:
    """What a joint gives under its body's inertia, rms."""
    body = int(np.argmin(joint))
    held = float(evidence.model.stiffness[body, body])
    if joint[body] >= 0 or held <= 0:
        return travel
    speed = evidence.axis_velocity[evidence.used > 0, axis]
    acceleration = float(np.std(np.gradient(speed, 1 / evidence.sample_rate_hz)))
    return acceleration * float(evidence.model.mass[body, body]) / held


EFFECT = Effect(
    name="loose_joint",
    equation="F = -stiffness (|r| - gap / 2) sgn(r) where |r| > gap / 2, and -slip sgn(dr/dt) everywhere, r the "
    "joint's travel",
    source="Noel and Schoukens 2017, F-16 aircraft benchmark: gap and friction at a bolted wing payload",
    signature="the resonance of the part behind the joint moves with the level, down first and then up; odd harmonics "
    "around it",
    parameters=(
        Parameter("gap", 1e-12, 1e3, none=None, step=0.03),
        Parameter("stiffness", 1e-6, 1e12, none=0.0),
        Parameter("slip", 1e-9, 1e6, none=0.0),
    ),
    acts=JointForce(_change, _law, _pack, steps=STEPS),
    starts=_starts,
)
