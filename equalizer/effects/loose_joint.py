"""Loose joint between two bodies: dry friction at any relative displacement, and a spring beyond a gap.

With r the relative displacement of the bodies (m; a rotation: rad), g the gap, k the stiffness and F_c the slip force,

    F = -k (|r| - g / 2) sgn(r) [|r| > g / 2] - F_c sgn(dr/dt).

Over a step the spring's force is the weighted mean of the forces at both ends (theta method of implicit integration): F
= -k ((1 - theta) p + theta p+), with p the deflection of the spring at the start and p+ = p_free + c F the deflection
at the end, which depends on F through the compliance c of the structure over the step. theta is 1/2 (trapezoidal rule)
where k c is small, and tends to 1 (backward Euler) where the spring is too stiff for the step and the trapezoidal rule
would ring. Friction is solved last, for the velocity that results with the spring's force. An entry of `catalogue`.
"""

from itertools import product

import numpy as np

from equalizer.effects.effect import Effect, JointForce, Parameter, PlacedEffect, Values, pack_values
from equalizer.effects.simulation.bodies import build_bodies, simulate_bodies
from equalizer.effects.simulation.command_path import ActuatorForce
from equalizer.effects.simulation.dry_friction_kernel import compute_friction_force
from equalizer.effects.simulation.instant import F_END, V_FREE, V_PER_N, X_FREE, X_PER_N, X
from equalizer.effects.simulation.mechanism_kernel import compile_law
from equalizer.effects.simulation.sensor_path import apply_low_pass
from equalizer.effects.starts.evidence import Evidence
from equalizer.effects.starts.starting_values import compute_quadratic_form
from equalizer.plant.linear_simulation import compute_driven_axes
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.signal import FloatArray

STEPS_PER_SAMPLE = 8
"""Integration steps per sample. Chosen."""
RELATIVE_GAPS, RELATIVE_STIFFNESSES, RELATIVE_SLIPS = (0.2, 0.5, 1.2, 3.0, 8.0), (0.05, 0.2, 0.6), (0.01, 0.1, 0.4)
"""Starting values that are tried: gaps relative to the joint's rms travel in the model; stiffnesses relative to the
model's stiffness along the joint; slip forces relative to that stiffness times that travel. Chosen."""
EXCERPT_S = 2.0
"""Length of the excerpt that is simulated (s), chosen to limit the computing time."""
SETTLING_DIVISOR = 4
"""The first 1/SETTLING_DIVISOR of the excerpt is not compared: the simulation starts at rest, the recording did not."""
REFINED_PAIRS = 4
"""Number of the best pairs of gap and stiffness that are tried with every slip force. Chosen."""
_NO_FORCE: Values = {"gap": 0.0, "stiffness": 0.0, "slip": 0.0}
"""Values without a force: the motion of the model alone, from which the joint's travel is computed."""


@compile_law
def _compute_mean_force(parameters: FloatArray, memory: FloatArray, step_motion: FloatArray) -> float:
    """Compute the mean force (N) of spring and friction over the step. parameters: gap (m), stiffness (N/m), slip force
    (N). memory: deflection of the friction bristle (`dry_friction_kernel`). step_motion: relative motion of the bodies
    (`instant`); the force at the end is written to it."""
    half_gap, stiffness, slip_force = 0.5 * parameters[0], parameters[1], parameters[2]
    spring_force = end_spring_force = 0.0
    for side in (1.0, -1.0):
        start_deflection, end_deflection = (
            max(side * step_motion[X] - half_gap, 0.0),
            side * step_motion[X_FREE] - half_gap,
        )
        if start_deflection > 0 or end_deflection > 0:
            stiffness_ratio = stiffness * step_motion[X_PER_N]
            end_weight = (0.5 + stiffness_ratio) / (1 + stiffness_ratio)
            contact_force = (
                stiffness
                * ((1 - end_weight) * start_deflection + end_weight * end_deflection)
                / (1 + end_weight * stiffness_ratio)
            )
            # Contact is lost within the step: no force at its end.
            if end_deflection - step_motion[X_PER_N] * contact_force < 0:
                contact_force = stiffness * (1 - end_weight) * start_deflection
            spring_force = -side * max(contact_force, 0.0)
            end_spring_force = -side * stiffness * max(end_deflection + side * step_motion[X_PER_N] * spring_force, 0.0)
            break
    step_motion[V_FREE] += step_motion[V_PER_N] * spring_force
    friction_force = compute_friction_force(slip_force, slip_force, memory[0], memory, step_motion)
    step_motion[F_END] += end_spring_force
    return float(spring_force + friction_force)


def find_joint_direction(model: MechanicalModel, axis: int) -> FloatArray:
    """Find the direction (n,) of relative motion of a joint at a driven axis, in the model's coordinates.

    The joint connects the axis to the undriven body that would have the largest kinetic energy if it followed the axis
    quasi-statically (mass times squared static displacement per displacement of the axis). Where no undriven body with
    a spring is coupled to the axis, the joint connects the axis to the ground. A coordinate is undriven where the norm
    of its components of the driven axes is below 1e-9 (rounding).
    """
    direction, axes = compute_driven_axes(model)[:, axis], compute_driven_axes(model)
    is_undriven = np.linalg.norm(axes, axis=1) < 1e-9
    if not is_undriven.any():
        return direction
    diagonal_stiffness = np.diagonal(model.stiffness)
    is_sprung = is_undriven & (diagonal_stiffness > 0)
    static_ratio = np.where(
        is_sprung, model.stiffness @ direction / np.where(diagonal_stiffness > 0, diagonal_stiffness, 1.0), 0.0
    )
    kinetic_energy = np.diagonal(model.mass) * static_ratio**2
    body = int(np.argmax(kinetic_energy))
    if kinetic_energy[body] == 0:
        return direction
    # Travel of the joint: static position of the body for the driven coordinates, minus its actual position.
    relative_direction = np.where(is_undriven, 0.0, -model.stiffness[body] / diagonal_stiffness[body])
    relative_direction[body] = -1.0
    return np.asarray(relative_direction)


def _locate_joint(model: MechanicalModel, axis: int, values: Values) -> tuple[MechanicalModel, FloatArray]:
    """Locate the joint: returns the unchanged model, whose bodies the joint connects, and the direction of the
    joint."""
    return model, find_joint_direction(model, axis)


def _find_starting_values(evidence: Evidence, axis: int) -> tuple[Values, ...]:
    """Find the two best sets of values of a coarse grid by the mean square error of a simulated excerpt: first all gaps
    and stiffnesses with the middle slip force, then the best of these pairs with the other slip forces. The scale of
    stiffness is that of the model along the joint, at least 1e-6 N/m, the lower limit of the parameter."""
    excerpt, direction = _find_strongest_excerpt(evidence, axis), find_joint_direction(evidence.model, axis)
    travel = float(np.std(_simulate_excerpt(evidence, axis, _NO_FORCE, excerpt)[1]))
    model_stiffness = max(
        abs(compute_quadratic_form(evidence.model.stiffness, direction)) / float(direction @ direction) ** 2, 1e-6
    )
    measured_response = evidence.response[excerpt]

    def compute_mean_square(values: Values) -> float:
        """Compute the mean square of the simulated excerpt's error over the noise, without the settling."""
        error = (_simulate_excerpt(evidence, axis, values, excerpt)[0] - measured_response) / evidence.noise
        return float(np.mean(error[len(error) // SETTLING_DIVISOR :] ** 2))

    def scale_values(relative_gap: float, relative_stiffness: float, relative_slip: float) -> Values:
        """Scale relative values to m, N/m and N."""
        return {
            "gap": relative_gap * travel,
            "stiffness": relative_stiffness * model_stiffness,
            "slip": relative_slip * model_stiffness * travel,
        }

    medium_slip = RELATIVE_SLIPS[len(RELATIVE_SLIPS) // 2]
    errors = {
        pair: compute_mean_square(scale_values(*pair, medium_slip))
        for pair in product(RELATIVE_GAPS, RELATIVE_STIFFNESSES)
    }
    best_pairs = sorted(errors, key=errors.__getitem__)[:REFINED_PAIRS]
    scored_values = [(errors[pair], scale_values(*pair, medium_slip)) for pair in best_pairs]
    other_slips = [scale_values(*pair, slip) for pair in best_pairs for slip in RELATIVE_SLIPS if slip != medium_slip]
    scored_values += [(compute_mean_square(values), values) for values in other_slips]
    return tuple(values for _, values in sorted(scored_values, key=lambda item: item[0])[:2])


def _find_strongest_excerpt(evidence: Evidence, axis: int) -> slice:
    """Find the excerpt of at most `EXCERPT_S` in which the acceleration of the axis has the largest sum of squares over
    the samples with `evidence.used` > 0."""
    excerpt_samples = min(int(EXCERPT_S * evidence.sample_rate_hz), len(evidence.command))
    acceleration = np.gradient(evidence.axis_velocity[:, axis])
    cumulative_power = np.cumsum(np.append(0.0, acceleration**2 * evidence.used))
    first_sample = int(np.argmax(cumulative_power[excerpt_samples:] - cumulative_power[:-excerpt_samples]))
    return slice(first_sample, first_sample + excerpt_samples)


def _simulate_excerpt(evidence: Evidence, axis: int, values: Values, excerpt: slice) -> tuple[FloatArray, FloatArray]:
    """Simulate an excerpt of the commands from rest. Returns the response (n, p) and the travel (n,) of the joint
    (m)."""
    bodies = build_bodies(evidence.model, (PlacedEffect(EFFECT, (axis,), values),))
    commands, rate_hz = evidence.command[excerpt], evidence.sample_rate_hz
    outputs, _ = simulate_bodies(
        bodies, ActuatorForce(commands, commands), (len(commands), STEPS_PER_SAMPLE), 1 / rate_hz / STEPS_PER_SAMPLE
    )
    # Columns: positions, velocities, accelerations of the ports (axes, then the joint), response, its positions.
    port_count = bodies.ports.shape[1]
    response = outputs[:, 3 * port_count : 3 * port_count + evidence.model.outputs]
    return apply_low_pass(response, rate_hz, evidence.model.sensor.bandwidth_hz), outputs[:, port_count - 1]


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
    action=JointForce(
        _locate_joint, _compute_mean_force, pack_values("gap", "stiffness", "slip"), memory=1, steps=STEPS_PER_SAMPLE
    ),
    starts=_find_starting_values,
)
