"""Forces along a measured motion: the actuators' force, and the motion-dependent forces of effects.

The motion is not simulated: the laws are evaluated at the measured positions, velocities and accelerations. Sizes: n
samples, m driven axes. Forces are in N (a rotation: N m). Called by `analysis.diagnosis`.
"""

from collections.abc import Sequence

import numpy as np

from equalizer.effects.effect import STEPS, AxisForce, PlacedEffect
from equalizer.effects.simulation.bodies import build_bodies, pack_kernel_forces
from equalizer.effects.simulation.command_path import drive_actuators, has_intersample_changes, subdivide_commands
from equalizer.effects.simulation.forces_along_motion_kernel import evaluate_laws_along_motion
from equalizer.plant.linear_simulation import discretise_model
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.recording import Hold
from equalizer.signals.signal import FloatArray

REST_SPEED_SHARE = 0.01
"""Share of the rms speed, below which an axis with negligible mass may be at rest. Chosen."""

Motion = tuple[FloatArray, FloatArray, FloatArray]
"""Positions (m or rad), velocities and accelerations (per s, per s²) of the driven axes, (n, m) each."""


def compute_actuator_force(
    model: MechanicalModel, commands: FloatArray, sample_rate_hz: float, effects: Sequence[PlacedEffect], hold: Hold
) -> FloatArray:
    """Compute the force (n, m) of the actuators for commands (n, m): the mean over each sample period, with the effects
    that act on the command."""
    steps_per_sample = STEPS if has_intersample_changes(model, effects, hold) else 1
    subdivided_force = drive_actuators(
        model, subdivide_commands(commands, steps_per_sample, hold), 1 / (sample_rate_hz * steps_per_sample), effects
    )
    return np.asarray(subdivided_force.mean.reshape(len(commands), steps_per_sample, -1).mean(axis=1))


def compute_effect_forces_along_motion(
    model: MechanicalModel, effects: Sequence[PlacedEffect], motion: Motion, forces: tuple[FloatArray, FloatArray],
    sample_rate_hz: float,
) -> FloatArray:  # fmt: skip
    """Compute the sum of the effects' forces (n, m), n >= 2, at the driven axes along the motion; effects that are no
    `AxisForce` add nothing. forces: (n, m) each, the commands, and the unbalanced force: actuator force minus the force
    that the linear model needs for the motion, mean over each step. Friction at rest balances it. Raises ValueError
    where an effect names an axis that the model lacks, or for more laws than the kernel holds."""
    commands, unbalanced_force = forces
    bodies = build_bodies(model, [effect for effect in effects if isinstance(effect.effect.action, AxisForce)])
    if not bodies.actions:
        return np.zeros_like(unbalanced_force)
    axes = tuple(range(model.inputs))
    kernel_forces = pack_kernel_forces(bodies, axes)
    discrete_model = discretise_model(model, 1 / sample_rate_hz)
    motion_per_newton = np.vstack(
        [
            _select_diagonal_responses(discrete_model.motion[: 2 * len(axes)] @ discrete_model.state_by_port_force),
            _select_diagonal_responses(discrete_model.motion_by_port_force[2 * len(axes) :]),
        ]
    )
    _limit_light_axis_response(motion_per_newton, motion[1], commands, 1 / sample_rate_hz)
    force = np.array(unbalanced_force, dtype=np.float64, order="C")
    position, velocity, acceleration = (np.ascontiguousarray(signal) for signal in motion)
    evaluate_laws_along_motion(
        kernel_forces.laws, kernel_forces.force_indices, kernel_forces.parameters, kernel_forces.memory,
        (position, velocity, acceleration),
        np.ascontiguousarray(commands, dtype=np.float64) if kernel_forces.reads_all_axes else np.empty((0, 0)),
        motion_per_newton, force, 1 / sample_rate_hz,
    )  # fmt: skip
    return force


def _limit_light_axis_response(
    motion_per_newton: FloatArray, velocity: FloatArray, commands: FloatArray, step_s: float
) -> None:
    """Limit, for axes with negligible mass, what 1 N over a step adds to position, velocity and acceleration:
    motion_per_newton (3, m) is changed in place.

    The mass of an axis is negligible where the rms command would change its velocity within a step by more than the rms
    velocity, as with a mass at a fit's lower bound, or without a time axis. Friction would then hardly ever slide, and
    would balance most of the missing force. With motion_per_newton reduced, it is at rest only where the measured
    velocity is below about `REST_SPEED_SHARE` of its rms.
    """
    rms_command, rms_speed = (np.sqrt(np.mean(signal**2, axis=0)) for signal in (commands, velocity))
    is_light = (motion_per_newton[2] * step_s * rms_command > rms_speed) & (rms_speed > 0)
    limited_velocity = REST_SPEED_SHARE * rms_speed[is_light] / rms_command[is_light]
    motion_per_newton[:, is_light] = limited_velocity * np.array([[step_s / 2], [1.0], [1 / step_s]])


def _select_diagonal_responses(motion_per_newton: FloatArray) -> FloatArray:
    """Select the response (k, m) of each axis to a force on the same axis, from the responses (k m, m) of all axes, k
    quantities, to a force on each."""
    axis_count = motion_per_newton.shape[1]
    return np.asarray(np.diagonal(motion_per_newton.reshape(-1, axis_count, axis_count), axis1=1, axis2=2))
