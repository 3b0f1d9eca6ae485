"""Faults of the mechanism, injected by altering the recorded command (inverse injection).

The measured motion stays. A mechanism with an additional force F(x, v, a) would have needed u + F for the same motion,
and a drive with the characteristic g would have needed u' with g(u') = u. Both are what a controller that imposes the
motion would command, and exact for any other behaviour of the device.

Written for the challenge only: no code is shared with the effects that a diagnosis compares.
"""

from collections.abc import Callable

import numpy as np

from equalizer.signals.signal import FloatArray
from study.evaluation.challenge.injection.axis_motion import AxisMotion
from study.evaluation.challenge.injection.drive_injections import (
    DRIVE_INJECTIONS,
    ForceInjection,
    Values,
    level_of,
    rms,
)

SHARP = 0.05
"""Width of the sign change of dry friction, as a fraction of the rms speed."""


def _scale_shape(name: str, shape: Callable[[AxisMotion], FloatArray]) -> ForceInjection:
    """Injection of a force with one parameter, which scales a given shape."""

    def draw(motion: AxisMotion, strength: float, random: np.random.Generator) -> dict[str, float]:
        return {"size": level_of(motion, strength) / max(rms(shape(motion)), 1e-300)}

    return ForceInjection(name, draw, lambda motion, values: motion.command + values["size"] * shape(motion))


def _sign(motion: AxisMotion) -> FloatArray:
    return np.asarray(np.tanh(motion.v / max(SHARP * float(np.sqrt(np.mean(motion.v**2))), 1e-300)))


def _centre_position(motion: AxisMotion) -> FloatArray:
    return np.asarray(motion.q - 0.5 * (motion.q.min() + motion.q.max()))


def _draw_cogging(motion: AxisMotion, strength: float, random: np.random.Generator) -> dict[str, float]:
    pitch = float(np.ptp(motion.q)) * float(random.uniform(0.03, 0.3))
    return {"amplitude": 1.4 * level_of(motion, strength), "pitch": pitch, "turn": float(random.random())}


def _add_cogging(motion: AxisMotion, values: Values) -> FloatArray:
    return motion.command + values["amplitude"] * np.sin(2 * np.pi * (motion.q / values["pitch"] + values["turn"]))


def _travel_beyond(motion: AxisMotion, position: float) -> FloatArray:
    far = _centre_position(motion)
    return np.asarray(np.sign(far) * np.maximum(np.abs(far) - position, 0.0))


def _draw_stop(motion: AxisMotion, strength: float, random: np.random.Generator) -> dict[str, float]:
    position = float(random.uniform(0.4, 0.9)) * float(np.abs(_centre_position(motion)).max())
    stiffness = level_of(motion, strength) / max(rms(_travel_beyond(motion, position)), 1e-300)
    return {"position": position, "stiffness": stiffness}


def _draw_asymmetric(motion: AxisMotion, strength: float, random: np.random.Generator) -> dict[str, float]:
    level, share = 1.2 * level_of(motion, strength), float(random.uniform(0.2, 0.6))
    return {"level_positive": level * (1 + share), "level_negative": level * (1 - share)}


def _add_asymmetric_friction(motion: AxisMotion, values: Values) -> FloatArray:
    sign = _sign(motion)
    return motion.command + np.where(sign > 0, values["level_positive"], values["level_negative"]) * sign


def _draw_bristles(motion: AxisMotion, strength: float, random: np.random.Generator) -> dict[str, float]:
    give = float(np.ptp(motion.q)) * float(random.uniform(0.01, 0.15))
    level = 1.2 * level_of(motion, strength)
    return {"level": level, "stiffness": level / give}


def _add_bristles(motion: AxisMotion, values: Values) -> FloatArray:
    """Elastoplastic friction: a spring that slides at the level."""
    force, found = 0.0, np.empty(len(motion.q))
    for k, way in enumerate(np.diff(motion.q, prepend=motion.q[0])):
        force = min(max(force + values["stiffness"] * way, -values["level"]), values["level"])
        found[k] = force
    return motion.command + found


FORCE_INJECTIONS: tuple[ForceInjection, ...] = (
    _scale_shape("added_mass", lambda motion: motion.a),
    _scale_shape("viscous_damping", lambda motion: motion.v),
    _scale_shape("quadratic_damping", lambda motion: motion.v * np.abs(motion.v)),
    _scale_shape("coulomb_friction", _sign),
    ForceInjection("asymmetric_friction", _draw_asymmetric, _add_asymmetric_friction),
    ForceInjection("presliding_hysteresis", _draw_bristles, _add_bristles, memory=True),
    _scale_shape("added_stiffness", _centre_position),
    _scale_shape("hardening_stiffness", lambda motion: _centre_position(motion) ** 3),
    ForceInjection("cogging", _draw_cogging, _add_cogging),
    ForceInjection(
        "end_stop",
        _draw_stop,
        lambda motion, values: motion.command + values["stiffness"] * _travel_beyond(motion, values["position"]),
    ),
    *DRIVE_INJECTIONS,
)
"""Faults of mechanism and drive: name, draw of the parameters, and the command that would have been needed."""
