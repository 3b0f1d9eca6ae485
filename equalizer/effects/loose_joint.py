"""A bolted joint that is loose: within a gap it only rubs, beyond it is stiff."""

from dataclasses import replace

import numpy as np

from equalizer.effects.bodies import bodies_of, moved
from equalizer.effects.command_path import Driven
from equalizer.effects.effect import Effect, JointForce, Parameter, PlacedEffect, Values
from equalizer.effects.evidence import Evidence
from equalizer.effects.instant import V_FREE, V_PER_N, X_FREE, X_PER_N, X
from equalizer.effects.mechanism_kernel import compiled_law
from equalizer.effects.sensor_path import low_passed
from equalizer.effects.starting_values import SLOW, Beside
from equalizer.plant.linear_simulation import driven_axes
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.signal import FloatArray

STEPS = 8
"""Per sample."""
GAPS = np.geomspace(0.05, 5.0, 10)
"""Tried, over the joint's rms travel."""


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
    """(n,): how a joint near a driven axis moves: against the heaviest body that hangs on it, or against the ground where
    nothing does."""
    along, axes = driven_axes(model)[:, axis], driven_axes(model)
    carried = np.linalg.norm(axes, axis=1) < 1e-9
    if not carried.any():
        return along
    held = np.diagonal(model.stiffness)
    tied = np.where(carried & (held > 0), model.stiffness @ along / np.where(held > 0, held, 1.0), 0.0)
    weight = np.diagonal(model.mass) * tied**2
    body = int(np.argmax(weight))
    if weight[body] == 0:
        return along
    follows = np.where(carried, 0.0, -model.stiffness[body] / held[body])
    follows[body] = -1.0
    return np.asarray(follows)


def _change(model: MechanicalModel, axis: int, values: Values) -> tuple[MechanicalModel, FloatArray]:
    return model, joint_at(model, axis)


def _pack(model: MechanicalModel, axis: int, values: Values) -> FloatArray:
    return np.array([values["gap"], values["stiffness"], values["slip"]])


def _starts(evidence: Evidence, axis: int) -> tuple[Values, ...]:
    """By the joint's travel in the model without it, and by what forces along that travel do to the response."""
    travel, speed = _in_joint(evidence, axis)
    used, rms = evidence.used > 0, float(np.std(travel))
    left = ((evidence.response - evidence.predicted) / evidence.noise)[used].ravel()
    rubbing = -np.tanh(speed / max(SLOW * float(np.std(speed)), np.finfo(float).tiny))
    nuisances = [_answer(evidence, axis, force)[used].ravel() for force in (-travel, -speed)]
    beside = Beside(left, np.column_stack(nuisances))
    slipped = _answer(evidence, axis, rubbing)[used].ravel()
    tried: list[tuple[float, Values]] = []
    for gap in (GAPS * rms).tolist():
        beyond = -np.sign(travel) * np.maximum(np.abs(travel) - gap / 2, 0.0)
        fit = beside.fit(_answer(evidence, axis, beyond)[used].ravel(), slipped)
        stiffness, slip = fit.strengths.tolist()
        if stiffness > 0:
            tried.append((fit.explained, {"gap": gap, "stiffness": stiffness, "slip": max(slip, 0.0)}))
    return tuple(values for _, values in sorted(tried, key=lambda item: -item[0])[:2])


def _in_joint(evidence: Evidence, axis: int) -> tuple[FloatArray, FloatArray]:
    silent = {"gap": 0.0, "stiffness": 0.0, "slip": 0.0}
    bodies = bodies_of(evidence.model, (PlacedEffect(EFFECT, (axis,), silent),))
    commands = Driven(evidence.command, evidence.command)
    looked, _ = moved(bodies, commands, (len(evidence.command), 1), 1 / evidence.sample_rate_hz)
    ports = bodies.ports.shape[1]
    return looked[:, ports - 1], looked[:, 2 * ports - 1]


def _answer(evidence: Evidence, axis: int, force: FloatArray) -> FloatArray:
    """(n, p): of the response to a force (n,) in the joint, over the noise."""
    model = replace(evidence.model, input=joint_at(evidence.model, axis)[:, None])
    bodies, one = bodies_of(model, ()), force[:, None]
    looked, _ = moved(bodies, Driven(one, one), (len(force), 1), 1 / evidence.sample_rate_hz)
    response = looked[:, 3 : 3 + model.outputs]
    return low_passed(response, evidence.sample_rate_hz, model.sensor.bandwidth_hz) / evidence.noise


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
