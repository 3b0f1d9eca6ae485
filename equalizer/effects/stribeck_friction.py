"""Stribeck friction: dry friction that falls from its static to its Coulomb level as the velocity rises.

    F = -(coulomb + (static - coulomb) exp(-(v / speed)²)) sgn(v)        levels in N, speed in m/s

The force jumps at v = 0; the simulation replaces the jump by a bristle of nanometre travel (`dry_friction_kernel`). An
entry of `equalizer.effects.catalogue`.
"""

import numpy as np

from equalizer.effects.effect import AxisForce, Effect, Parameter, Values
from equalizer.effects.simulation.dry_friction_kernel import compute_friction_force
from equalizer.effects.simulation.instant import V_FREE, V_PER_N, V
from equalizer.effects.simulation.mechanism_kernel import compile_law
from equalizer.effects.starts.evidence import Evidence
from equalizer.effects.starts.starting_values import find_best_trial, regress_out_linear_terms, select_sliding_motion
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.signal import FloatArray

RELATIVE_SPEEDS = np.geomspace(0.03, 1.5, 12)
"""Stribeck velocities that are tried as starting values, relative to the rms velocity. Chosen."""
_INITIAL_STATIC_RATIO = 1.2
"""Starting ratio of static to Coulomb friction where the data show no higher friction at low speed. Chosen."""


@compile_law
def _compute_mean_force(parameters: FloatArray, memory: FloatArray, step_motion: FloatArray) -> float:
    """Compute the mean friction force (N) over the step, at its mean velocity, which depends on the force: at most
    three fixed-point iterations, each from the same bristle deflection, until the level changes by at most a millionth.
    parameters: as `_pack_parameters` returns them. memory: deflection of the bristle, relative to that at which it
    slips."""
    mean_velocity, force, start_deflection, previous_level = step_motion[V], 0.0, memory[0], -1.0
    for _ in range(3):
        level = parameters[0] + (parameters[1] - parameters[0]) * np.exp(-((mean_velocity / parameters[2]) ** 2))
        if abs(level - previous_level) <= 1e-6 * level:
            break
        previous_level = level
        force = compute_friction_force(level, level, start_deflection, memory, step_motion)
        mean_velocity = 0.5 * (step_motion[V] + step_motion[V_FREE] + step_motion[V_PER_N] * force)
    return float(force)


def _pack_parameters(model: MechanicalModel, axis: int, values: Values) -> FloatArray:
    """Pack the parameters of `_compute_mean_force`, (3,): Coulomb level, static level and Stribeck velocity, the latter
    above zero because the law divides by it."""
    return np.array([values["coulomb"], values["static"], max(values["speed"], 1e-12)])


def _find_starting_values(evidence: Evidence, axis: int) -> tuple[Values, ...]:
    """Find the levels by regression of the missing force, at the tried Stribeck velocity that explains most. Empty
    where neither level is positive; the Coulomb level is at least a twentieth of the static excess, and the static
    level `_INITIAL_STATIC_RATIO` times it where the excess is at most 2 % of it (limits chosen)."""
    motion = select_sliding_motion(evidence, axis)
    sliding_direction, rms_velocity = np.sign(motion.velocity), float(np.sqrt(np.mean(motion.velocity**2)))
    speed, fit = find_best_trial(
        regress_out_linear_terms(motion),
        (RELATIVE_SPEEDS * rms_velocity).tolist(),
        lambda trial_speed: (-sliding_direction, -sliding_direction * np.exp(-((motion.velocity / trial_speed) ** 2))),
    )
    coulomb_level, static_excess = fit.strengths.tolist()
    if coulomb_level <= 0 and coulomb_level + static_excess <= 0:
        return ()
    coulomb_level = max(coulomb_level, 0.05 * static_excess)
    static_level = (
        coulomb_level + static_excess if static_excess > 0.02 * coulomb_level else _INITIAL_STATIC_RATIO * coulomb_level
    )
    return ({"coulomb": coulomb_level, "static": static_level, "speed": speed},)


EFFECT = Effect(
    name="stribeck_friction",
    equation="F = -(coulomb + (static - coulomb) exp(-(v / speed)^2)) sgn(v)",
    source="Bo and Pavelescu 1982, Wear 82:277; Armstrong-Helouvry 1994, Automatica 30:1083",
    signature="the missing force flips its sign with the velocity and has a hump at low speed; its odd harmonics fall "
    "steeply as the level rises",
    parameters=(
        Parameter("coulomb", 1e-9, 1e6, none=0.0),
        Parameter("static", 1e-9, 1e6, none=0.0),
        Parameter("speed", 1e-6, 1e3, none=None, step=0.03),
    ),
    action=AxisForce(_compute_mean_force, _pack_parameters, memory=1),
    starts=_find_starting_values,
    simpler=("coulomb_friction",),
)
