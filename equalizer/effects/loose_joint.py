"""Loose joint: dry friction alone within a gap, a spring beyond it.

The force acts along the joint's travel r, and adds to what the model has there: between the driven axis and the
heaviest body attached to it or, where there is none, between the axis and the ground (`joint_direction`).
"""

from itertools import product

import numpy as np

from equalizer.effects.effect import Effect, JointForce, Parameter, PlacedEffect, Values
from equalizer.effects.simulation.bodies import bodies_of, simulate_bodies
from equalizer.effects.simulation.command_path import ActuatorForce
from equalizer.effects.simulation.dry_friction_kernel import friction_force
from equalizer.effects.simulation.instant import F_END, V_FREE, V_PER_N, X_FREE, X_PER_N, X
from equalizer.effects.simulation.mechanism_kernel import compile_law
from equalizer.effects.simulation.sensor_path import low_pass
from equalizer.effects.starts.evidence import Evidence
from equalizer.effects.starts.starting_values import value_along
from equalizer.plant.linear_simulation import driven_axes
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.signal import FloatArray

STEPS = 8
"""Integration steps per sample."""
GAPS, STIFFNESSES, SLIPS = (0.2, 0.5, 1.2, 3.0, 8.0), (0.05, 0.2, 0.6), (0.01, 0.1, 0.4)
"""Starting values that are tried: gaps relative to the joint's rms travel in the model; stiffnesses relative to the
model's at the joint; slip forces relative to that stiffness times that travel."""
TRIED_S, SETTLING, FINER = 2.0, 4, 4
"""Seconds of the recording that are simulated; a quarter of them, at the beginning, is not compared, because the
simulation starts from rest; number of the best pairs of gap and stiffness that are tried with every slip force."""
_ABSENT: Values = {"gap": 0.0, "stiffness": 0.0, "slip": 0.0}
"""Values with which the joint has no force of its own."""


@compile_law
def _law(parameters: FloatArray, memory: FloatArray, at: FloatArray) -> float:
    """Spring force beyond the gap, averaged over the step, then as much friction as is needed to stop the motion, up to
    its limit."""
    half, stiffness, slip = 0.5 * parameters[0], parameters[1], parameters[2]
    spring = last = 0.0
    for way in (1.0, -1.0):
        start, end = max(way * at[X] - half, 0.0), way * at[X_FREE] - half
        if start > 0 or end > 0:
            # Weighted towards the force at the end where the spring is too stiff for the step: the mean would
            # overshoot.
            slack = stiffness * at[X_PER_N]
            late = (0.5 + slack) / (1 + slack)
            push = stiffness * ((1 - late) * start + late * end) / (1 + late * slack)
            if end - at[X_PER_N] * push < 0:
                push = stiffness * (1 - late) * start
            spring = -way * max(push, 0.0)
            last = -way * stiffness * max(end + way * at[X_PER_N] * spring, 0.0)
            break
    at[V_FREE] += at[V_PER_N] * spring
    slipped = friction_force(slip, slip, memory[0], memory, at)
    at[F_END] += last
    return float(spring + slipped)


def joint_direction(model: MechanicalModel, axis: int) -> FloatArray:
    """(n,): direction of motion of a joint near a driven axis: against the heaviest body attached to the axis, or
    against the ground where there is none."""
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
    return model, joint_direction(model, axis)


def _pack(model: MechanicalModel, axis: int, values: Values) -> FloatArray:
    return np.array([values["gap"], values["stiffness"], values["slip"]])


def _starts(evidence: Evidence, axis: int) -> tuple[Values, ...]:
    """The best of a coarse grid, by the residual on an excerpt of the record: first gaps and stiffnesses, then
    slips."""
    part, joint = _strongest_part(evidence, axis), joint_direction(evidence.model, axis)
    travel = float(np.std(_simulate_part(evidence, axis, _ABSENT, part)[1]))
    held = max(abs(value_along(evidence.model.stiffness, joint)) / float(joint @ joint) ** 2, 1e-6)
    measured = evidence.response[part]

    def left(values: Values) -> float:
        off = (_simulate_part(evidence, axis, values, part)[0] - measured) / evidence.noise
        return float(np.mean(off[len(off) // SETTLING :] ** 2))

    def at(gap: float, stiffness: float, slip: float) -> Values:
        return {"gap": gap * travel, "stiffness": stiffness * held, "slip": slip * held * travel}

    middle = SLIPS[len(SLIPS) // 2]
    tried = {where: left(at(*where, middle)) for where in product(GAPS, STIFFNESSES)}
    best = sorted(tried, key=tried.__getitem__)[:FINER]
    found = [(tried[where], at(*where, middle)) for where in best]
    found += [(left(at(*where, slip)), at(*where, slip)) for where in best for slip in SLIPS if slip != middle]
    return tuple(values for _, values in sorted(found, key=lambda item: item[0])[:2])


def _strongest_part(evidence: Evidence, axis: int) -> slice:
    """The excerpt in which the axis, and with it the joint, is accelerated most."""
    length = min(int(TRIED_S * evidence.sample_rate_hz), len(evidence.command))
    shaken = np.gradient(evidence.axis_velocity[:, axis])
    power = np.cumsum(np.append(0.0, shaken**2 * evidence.used))
    first = int(np.argmax(power[length:] - power[:-length]))
    return slice(first, first + length)


def _simulate_part(evidence: Evidence, axis: int, values: Values, part: slice) -> tuple[FloatArray, FloatArray]:
    """The response (n, p), and the joint's travel (n,)."""
    bodies = bodies_of(evidence.model, (PlacedEffect(EFFECT, (axis,), values),))
    commands, rate_hz = evidence.command[part], evidence.sample_rate_hz
    looked, _ = simulate_bodies(bodies, ActuatorForce(commands, commands), (len(commands), STEPS), 1 / rate_hz / STEPS)
    ports = bodies.ports.shape[1]
    response = looked[:, 3 * ports : 3 * ports + evidence.model.outputs]
    return low_pass(response, rate_hz, evidence.model.sensor.bandwidth_hz), looked[:, ports - 1]


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
    acts=JointForce(_change, _law, _pack, memory=1, steps=STEPS),
    starts=_starts,
)
