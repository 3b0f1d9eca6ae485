"""Faults of the mechanism, injected by altering the recorded command (inverse injection).

The measured motion is left unchanged. A mechanism with an additional resisting force F(x, v, a) would have needed the
command u + F for the same motion. This is exact for any other dynamics of the device, because a controller that imposes
the motion would command just these forces.

Written for the challenge only: no code is shared with the effects that a diagnosis compares, so that an error in those
effects is not injected as well. Ranges of the drawn parameters are set by hand. Positions, velocities and forces have
the units of the recording. The rms values that scale a force are at least 1e-300, so that they can be divided by; the
travel of an axis at rest counts as 1 for cogging and presliding friction.
"""

from collections.abc import Callable

import numpy as np

from equalizer.signals.signal import FloatArray
from study.evaluation.challenge.injection.axis_motion import AxisMotion
from study.evaluation.challenge.injection.drive_injections import (
    DRIVE_INJECTIONS,
    ForceInjection,
    Values,
    compute_centred_rms,
    compute_force_level,
)

SIGN_WIDTH_RATIO = 0.05
"""Width of the smoothed sign of the velocity, tanh(v / width), as a fraction of the rms speed. Chosen: narrow
compared with the motion."""


def _make_scaled_injection(name: str, compute_shape: Callable[[AxisMotion], FloatArray]) -> ForceInjection:
    """Make the injection of the force size * compute_shape(motion). The size is such that the rms of the force about
    its mean is `compute_force_level`."""

    def draw_size(motion: AxisMotion, strength: float, random: np.random.Generator) -> dict[str, float]:
        """Compute the factor of the shape; `random` is not used."""
        return {"size": compute_force_level(motion, strength) / max(compute_centred_rms(compute_shape(motion)), 1e-300)}

    return ForceInjection(
        name, draw_size, lambda motion, values: motion.command + values["size"] * compute_shape(motion)
    )


def _smooth_sign(motion: AxisMotion) -> FloatArray:
    """Compute the smoothed sign of the velocity, (n,), -1 to 1."""
    return np.asarray(np.tanh(motion.v / max(SIGN_WIDTH_RATIO * float(np.sqrt(np.mean(motion.v**2))), 1e-300)))


def _centre_position(motion: AxisMotion) -> FloatArray:
    """Compute the position relative to the middle of its range, (n,)."""
    return np.asarray(motion.q - 0.5 * (motion.q.min() + motion.q.max()))


def _measure_travel(motion: AxisMotion) -> float:
    """Measure the travel, from end to end; 1 where the axis is at rest, so that it can be divided by."""
    return float(np.ptp(motion.q)) or 1.0


def _draw_cogging(motion: AxisMotion, strength: float, random: np.random.Generator) -> dict[str, float]:
    """Draw amplitude, pitch (3 to 30 % of the travel) and phase (turns) of cogging. 1.4: amplitude over rms of a
    sine."""
    pitch = _measure_travel(motion) * float(random.uniform(0.03, 0.3))
    return {"amplitude": 1.4 * compute_force_level(motion, strength), "pitch": pitch, "turn": float(random.random())}


def _add_cogging(motion: AxisMotion, values: Values) -> FloatArray:
    """Compute the command (n,) with the force amplitude * sin(2 pi (q / pitch + turn))."""
    return motion.command + values["amplitude"] * np.sin(2 * np.pi * (motion.q / values["pitch"] + values["turn"]))


def _compute_penetration(motion: AxisMotion, stop_position: float) -> FloatArray:
    """Compute the signed penetration (n,) of stops at +-stop_position from the centre; 0 between them."""
    displacement = _centre_position(motion)
    return np.asarray(np.sign(displacement) * np.maximum(np.abs(displacement) - stop_position, 0.0))


def _draw_end_stops(motion: AxisMotion, strength: float, random: np.random.Generator) -> dict[str, float]:
    """Draw the position of the stops, 40 to 90 % of the largest excursion, and their stiffness."""
    stop_position = float(random.uniform(0.4, 0.9)) * float(np.abs(_centre_position(motion)).max())
    stiffness = compute_force_level(motion, strength) / max(
        compute_centred_rms(_compute_penetration(motion, stop_position)), 1e-300
    )
    return {"position": stop_position, "stiffness": stiffness}


def _draw_asymmetric_friction(motion: AxisMotion, strength: float, random: np.random.Generator) -> dict[str, float]:
    """Draw the friction levels of the two directions, which differ from their mean by 20 to 60 %; the one of positive
    velocity is the larger. 1.2: chosen ratio of the mean level to the rms of the force."""
    mean_level, asymmetry = 1.2 * compute_force_level(motion, strength), float(random.uniform(0.2, 0.6))
    return {"level_positive": mean_level * (1 + asymmetry), "level_negative": mean_level * (1 - asymmetry)}


def _add_asymmetric_friction(motion: AxisMotion, values: Values) -> FloatArray:
    """Compute the command (n,) with Coulomb friction of a different level in each direction."""
    smoothed_sign = _smooth_sign(motion)
    return (
        motion.command + np.where(smoothed_sign > 0, values["level_positive"], values["level_negative"]) * smoothed_sign
    )


def _draw_elastoplastic_friction(motion: AxisMotion, strength: float, random: np.random.Generator) -> dict[str, float]:
    """Draw the friction level, 1.2 times `compute_force_level` (chosen), and the stiffness of the bristle, which slips
    after 1 to 15 % of the travel."""
    slip_distance = _measure_travel(motion) * float(random.uniform(0.01, 0.15))
    level = 1.2 * compute_force_level(motion, strength)
    return {"level": level, "stiffness": level / slip_distance}


def _add_elastoplastic_friction(motion: AxisMotion, values: Values) -> FloatArray:
    """Compute the command (n,) with elastoplastic friction: a spring whose force is limited to +-level, from 0 at the
    start."""
    force, friction_forces = 0.0, np.empty(len(motion.q))
    for index, travel_step in enumerate(np.diff(motion.q, prepend=motion.q[0])):
        force = min(max(force + values["stiffness"] * travel_step, -values["level"]), values["level"])
        friction_forces[index] = force
    return motion.command + friction_forces


FORCE_INJECTIONS: tuple[ForceInjection, ...] = (
    _make_scaled_injection("added_mass", lambda motion: motion.a),
    _make_scaled_injection("viscous_damping", lambda motion: motion.v),
    _make_scaled_injection("quadratic_damping", lambda motion: motion.v * np.abs(motion.v)),
    _make_scaled_injection("coulomb_friction", _smooth_sign),
    ForceInjection("asymmetric_friction", _draw_asymmetric_friction, _add_asymmetric_friction),
    ForceInjection("presliding_hysteresis", _draw_elastoplastic_friction, _add_elastoplastic_friction, memory=True),
    _make_scaled_injection("added_stiffness", _centre_position),
    _make_scaled_injection("hardening_stiffness", lambda motion: _centre_position(motion) ** 3),
    ForceInjection("cogging", _draw_cogging, _add_cogging),
    ForceInjection(
        "end_stop",
        _draw_end_stops,
        lambda motion, values: motion.command + values["stiffness"] * _compute_penetration(motion, values["position"]),
    ),
    *DRIVE_INJECTIONS,
)
"""Faults of mechanism and drive: name, draw of the parameters, and the command that would have been needed."""
