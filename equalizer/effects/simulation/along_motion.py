"""What effects add along a motion that was measured: the force that enters, and forces that depend on the motion."""

from collections.abc import Sequence

import numpy as np

from equalizer.effects.effect import STEPS, AxisForce, PlacedEffect
from equalizer.effects.simulation.along_motion_kernel import follow
from equalizer.effects.simulation.bodies import bodies_of, forces_of
from equalizer.effects.simulation.command_path import driven_by, finer, moves_between_samples
from equalizer.plant.linear_simulation import linear_steps
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.recording import Hold
from equalizer.signals.signal import FloatArray

Motion = tuple[FloatArray, FloatArray, FloatArray]
"""Positions, velocities and accelerations of the driven axes, (n, m) each."""


def entered_force(
    model: MechanicalModel, commands: FloatArray, sample_rate_hz: float, effects: Sequence[PlacedEffect], hold: Hold
) -> FloatArray:
    """(n, m): what the actuators make of the commands (n, m), mean over each sample's time."""
    fine = STEPS if moves_between_samples(model, effects, hold) else 1
    driven = driven_by(model, finer(commands, fine, hold), 1 / (sample_rate_hz * fine), effects)
    return np.asarray(driven.mean.reshape(len(commands), fine, -1).mean(axis=1))


def force_along(
    model: MechanicalModel, effects: Sequence[PlacedEffect], motion: Motion, forces: tuple[FloatArray, FloatArray],
    sample_rate_hz: float,
) -> FloatArray:  # fmt: skip
    """(n, m): what the effects' forces at the driven axes add along the motion. forces: (n, m) each, the commands, and
    the force over each step that the motion takes beside the linear model; what sticks answers to it."""
    commands, pushing = forces
    bodies = bodies_of(model, [effect for effect in effects if isinstance(effect.effect.acts, AxisForce)])
    if not bodies.acts:
        return np.zeros_like(pushing)
    axes = tuple(range(model.inputs))
    acting = forces_of(bodies, axes)
    steps = linear_steps(model, 1 / sample_rate_hz)
    per_newton = np.vstack(
        [_own(steps.motion[: 2 * len(axes)] @ steps.by_axis_force), _own(steps.motion_by_axis_force[2 * len(axes) :])]
    )
    force = np.array(pushing, dtype=np.float64, order="C")
    position, velocity, acceleration = (np.ascontiguousarray(each) for each in motion)
    follow(
        acting.laws, acting.places, acting.of, acting.memory, (position, velocity, acceleration),
        np.ascontiguousarray(commands, dtype=np.float64) if acting.sees else np.empty((0, 0)),
        per_newton, force, 1 / sample_rate_hz,
    )  # fmt: skip
    return force


def _own(per_newton: FloatArray) -> FloatArray:
    """(k, m) of each axis by its own force, from (k m, m)."""
    m = per_newton.shape[1]
    return np.asarray(np.diagonal(per_newton.reshape(-1, m, m), axis1=1, axis2=2))
