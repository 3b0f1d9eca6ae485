"""Loose joint between two bodies: dry friction at any relative displacement, and a spring beyond a gap.

With r the relative displacement of the bodies, g the gap, k the stiffness and F_c the slip force,

    F = -k (|r| - g / 2) sgn(r) [|r| > g / 2] - F_c sgn(dr/dt).

Over a step the spring's force is the weighted mean of the forces at both ends (theta method of implicit integration):
F = -k ((1 - theta) p + theta p+), with p the deflection of the spring at the start and p+ = p_free + c F the deflection
at the end, which depends on F through the compliance c of the structure over the step. theta is 1/2 (trapezoidal rule)
where k c is small, and tends to 1 (backward Euler) where the spring is too stiff for the step and the trapezoidal rule
would ring. Friction is solved last, for the velocity that results with the spring's force (`friction_force`).
"""

from itertools import product

import numpy as np

from equalizer.effects.effect import Effect, JointForce, Parameter, PlacedEffect, Values, pack_values
from equalizer.effects.simulation.bodies import build_bodies, simulate_bodies
from equalizer.effects.simulation.command_path import ActuatorForce
from equalizer.effects.simulation.dry_friction_kernel import friction_force
from equalizer.effects.simulation.instant import F_END, V_FREE, V_PER_N, X_FREE, X_PER_N, X
from equalizer.effects.simulation.mechanism_kernel import compile_law
from equalizer.effects.simulation.sensor_path import low_pass
from equalizer.effects.starts.evidence import Evidence
from equalizer.effects.starts.starting_values import quadratic_form
from equalizer.plant.linear_simulation import compute_driven_axes
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.signal import FloatArray

STEPS = 8
"""Integration steps per sample."""
RELATIVE_GAPS, RELATIVE_STIFFNESSES, RELATIVE_SLIPS = (0.2, 0.5, 1.2, 3.0, 8.0), (0.05, 0.2, 0.6), (0.01, 0.1, 0.4)
"""Starting values that are tried: gaps relative to the joint's rms travel in the model; stiffnesses relative to the
model's stiffness along the joint; slip forces relative to that stiffness times that travel."""
EXCERPT_S = 2.0
"""Length of the excerpt that is simulated (s)."""
SETTLING = 4
"""The first 1/SETTLING of the excerpt is not compared: the simulation starts at rest, the recording did not."""
REFINED_PAIRS = 4
"""Number of the best pairs of gap and stiffness that are tried with every slip force."""
_NO_FORCE: Values = {"gap": 0.0, "stiffness": 0.0, "slip": 0.0}
"""Values without a force: the motion of the model alone, from which the joint's travel is computed."""


@compile_law
def _law(parameters: FloatArray, memory: FloatArray, at: FloatArray) -> float:
    """Mean force (N) of spring and friction over the step; the force at its end is written to `at[F_END]`."""
    half_gap, stiffness, slip = 0.5 * parameters[0], parameters[1], parameters[2]
    spring = spring_at_end = 0.0
    for side in (1.0, -1.0):
        start, free_end = max(side * at[X] - half_gap, 0.0), side * at[X_FREE] - half_gap
        if start > 0 or free_end > 0:
            ratio = stiffness * at[X_PER_N]
            end_weight = (0.5 + ratio) / (1 + ratio)
            contact_force = stiffness * ((1 - end_weight) * start + end_weight * free_end) / (1 + end_weight * ratio)
            if free_end - at[X_PER_N] * contact_force < 0:  # contact is lost within the step: no force at its end
                contact_force = stiffness * (1 - end_weight) * start
            spring = -side * max(contact_force, 0.0)
            spring_at_end = -side * stiffness * max(free_end + side * at[X_PER_N] * spring, 0.0)
            break
    at[V_FREE] += at[V_PER_N] * spring
    friction = friction_force(slip, slip, memory[0], memory, at)
    at[F_END] += spring_at_end
    return float(spring + friction)


def joint_direction(model: MechanicalModel, axis: int) -> FloatArray:
    """(n,): direction of relative motion of a joint at a driven axis, in the model's coordinates.

    The joint connects the axis to the undriven body that would have the largest kinetic energy if it followed the axis
    quasi-statically (mass times squared static displacement per displacement of the axis). Where no undriven body with
    a spring is coupled to the axis, the joint connects the axis to the ground.
    """
    direction, axes = compute_driven_axes(model)[:, axis], compute_driven_axes(model)
    undriven = np.linalg.norm(axes, axis=1) < 1e-9
    if not undriven.any():
        return direction
    own_stiffness = np.diagonal(model.stiffness)
    is_sprung = undriven & (own_stiffness > 0)
    static_ratio = np.where(
        is_sprung, model.stiffness @ direction / np.where(own_stiffness > 0, own_stiffness, 1.0), 0.0
    )
    energy = np.diagonal(model.mass) * static_ratio**2
    body = int(np.argmax(energy))
    if energy[body] == 0:
        return direction
    # Travel of the joint: static position of the body for the driven coordinates, minus its actual position.
    relative = np.where(undriven, 0.0, -model.stiffness[body] / own_stiffness[body])
    relative[body] = -1.0
    return np.asarray(relative)


def _change(model: MechanicalModel, axis: int, values: Values) -> tuple[MechanicalModel, FloatArray]:
    """The unchanged model, whose bodies the joint connects, and the direction of the joint."""
    return model, joint_direction(model, axis)


def _starts(evidence: Evidence, axis: int) -> tuple[Values, ...]:
    """The two best values of a coarse grid by the mean square error of a simulated excerpt: first all gaps and
    stiffnesses with a medium slip force, then the best of these with the other slip forces."""
    excerpt, joint = _strongest_excerpt(evidence, axis), joint_direction(evidence.model, axis)
    travel = float(np.std(_simulate_excerpt(evidence, axis, _NO_FORCE, excerpt)[1]))
    model_stiffness = max(abs(quadratic_form(evidence.model.stiffness, joint)) / float(joint @ joint) ** 2, 1e-6)
    measured = evidence.response[excerpt]

    def mean_square(values: Values) -> float:
        error = (_simulate_excerpt(evidence, axis, values, excerpt)[0] - measured) / evidence.noise
        return float(np.mean(error[len(error) // SETTLING :] ** 2))

    def scaled(gap: float, stiffness: float, slip: float) -> Values:
        return {
            "gap": gap * travel,
            "stiffness": stiffness * model_stiffness,
            "slip": slip * model_stiffness * travel,
        }

    medium = RELATIVE_SLIPS[len(RELATIVE_SLIPS) // 2]
    errors = {pair: mean_square(scaled(*pair, medium)) for pair in product(RELATIVE_GAPS, RELATIVE_STIFFNESSES)}
    best = sorted(errors, key=errors.__getitem__)[:REFINED_PAIRS]
    candidates = [(errors[pair], scaled(*pair, medium)) for pair in best]
    other_slips = [scaled(*pair, slip) for pair in best for slip in RELATIVE_SLIPS if slip != medium]
    candidates += [(mean_square(values), values) for values in other_slips]
    return tuple(values for _, values in sorted(candidates, key=lambda item: item[0])[:2])


def _strongest_excerpt(evidence: Evidence, axis: int) -> slice:
    """The excerpt of at most `EXCERPT_S` in which the acceleration of the axis has the largest mean square."""
    length = min(int(EXCERPT_S * evidence.sample_rate_hz), len(evidence.command))
    acceleration = np.gradient(evidence.axis_velocity[:, axis])
    power = np.cumsum(np.append(0.0, acceleration**2 * evidence.used))
    first = int(np.argmax(power[length:] - power[:-length]))
    return slice(first, first + length)


def _simulate_excerpt(evidence: Evidence, axis: int, values: Values, excerpt: slice) -> tuple[FloatArray, FloatArray]:
    """Simulated response (n, p) of an excerpt, and travel (n,) of the joint in m, from rest."""
    bodies = build_bodies(evidence.model, (PlacedEffect(EFFECT, (axis,), values),))
    commands, rate_hz = evidence.command[excerpt], evidence.sample_rate_hz
    outputs, _ = simulate_bodies(bodies, ActuatorForce(commands, commands), (len(commands), STEPS), 1 / rate_hz / STEPS)
    # Columns: positions, velocities, accelerations of the ports (axes, then the joint), response, its positions.
    ports = bodies.ports.shape[1]
    response = outputs[:, 3 * ports : 3 * ports + evidence.model.outputs]
    return low_pass(response, rate_hz, evidence.model.sensor.bandwidth_hz), outputs[:, ports - 1]


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
    action=JointForce(_change, _law, pack_values("gap", "stiffness", "slip"), memory=1, steps=STEPS),
    starts=_starts,
)
