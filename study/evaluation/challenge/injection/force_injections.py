"""Faults of mechanism and actuator, put into a recording of a real device by way of its recorded command.

The motion stays as it was measured. A mechanism that also needs the force F(x, v, a) along it would have been given
that much more, and a drive that makes g(u') of a command u' would have been given the u' with g(u') = u: either is
what a controller does that holds the motion, and exact whatever else the device does.

Written for the challenge alone: nothing of it is shared with the effects that a diagnosis compares.
"""

from collections.abc import Callable

import numpy as np

from equalizer.signals.signal import FloatArray
from study.evaluation.challenge.injection.drive_injections import (
    DRIVE_INJECTIONS,
    ForceInjection,
    Numbers,
    level_of,
    rms,
)
from study.evaluation.challenge.injection.moved_axis import Moved

SHARP = 0.05
"""Of the rms speed, within which dry friction turns round."""


def _weighed(name: str, shape: Callable[[Moved], FloatArray]) -> ForceInjection:
    """A force of one number that multiplies a shape."""

    def draw(moved: Moved, strength: float, random: np.random.Generator) -> dict[str, float]:
        return {"size": level_of(moved, strength) / max(rms(shape(moved)), 1e-300)}

    return ForceInjection(name, draw, lambda moved, of: moved.command + of["size"] * shape(moved))


def _sign(moved: Moved) -> FloatArray:
    return np.asarray(np.tanh(moved.v / max(SHARP * float(np.sqrt(np.mean(moved.v**2))), 1e-300)))


def _centred(moved: Moved) -> FloatArray:
    return np.asarray(moved.q - 0.5 * (moved.q.min() + moved.q.max()))


def _draw_cogging(moved: Moved, strength: float, random: np.random.Generator) -> dict[str, float]:
    pitch = float(np.ptp(moved.q)) * float(random.uniform(0.03, 0.3))
    return {"amplitude": 1.4 * level_of(moved, strength), "pitch": pitch, "turn": float(random.random())}


def _cogging(moved: Moved, of: Numbers) -> FloatArray:
    return moved.command + of["amplitude"] * np.sin(2 * np.pi * (moved.q / of["pitch"] + of["turn"]))


def _beyond(moved: Moved, position: float) -> FloatArray:
    far = _centred(moved)
    return np.asarray(np.sign(far) * np.maximum(np.abs(far) - position, 0.0))


def _draw_stop(moved: Moved, strength: float, random: np.random.Generator) -> dict[str, float]:
    position = float(random.uniform(0.4, 0.9)) * float(np.abs(_centred(moved)).max())
    stiffness = level_of(moved, strength) / max(rms(_beyond(moved, position)), 1e-300)
    return {"position": position, "stiffness": stiffness}


def _draw_one_sided(moved: Moved, strength: float, random: np.random.Generator) -> dict[str, float]:
    level, share = 1.2 * level_of(moved, strength), float(random.uniform(0.2, 0.6))
    return {"level_positive": level * (1 + share), "level_negative": level * (1 - share)}


def _one_sided(moved: Moved, of: Numbers) -> FloatArray:
    sign = _sign(moved)
    return moved.command + np.where(sign > 0, of["level_positive"], of["level_negative"]) * sign


def _draw_bristles(moved: Moved, strength: float, random: np.random.Generator) -> dict[str, float]:
    give = float(np.ptp(moved.q)) * float(random.uniform(0.01, 0.15))
    level = 1.2 * level_of(moved, strength)
    return {"level": level, "stiffness": level / give}


def _bristles(moved: Moved, of: Numbers) -> FloatArray:
    """A spring that slides at the level."""
    force, found = 0.0, np.empty(len(moved.q))
    for k, way in enumerate(np.diff(moved.q, prepend=moved.q[0])):
        force = min(max(force + of["stiffness"] * way, -of["level"]), of["level"])
        found[k] = force
    return moved.command + found


FORCE_INJECTIONS: tuple[ForceInjection, ...] = (
    _weighed("added_mass", lambda moved: moved.a),
    _weighed("viscous_damping", lambda moved: moved.v),
    _weighed("quadratic_damping", lambda moved: moved.v * np.abs(moved.v)),
    _weighed("coulomb_friction", _sign),
    ForceInjection("asymmetric_friction", _draw_one_sided, _one_sided),
    ForceInjection("presliding_hysteresis", _draw_bristles, _bristles),
    _weighed("added_stiffness", _centred),
    _weighed("hardening_stiffness", lambda moved: _centred(moved) ** 3),
    ForceInjection("cogging", _draw_cogging, _cogging),
    ForceInjection(
        "end_stop", _draw_stop, lambda moved, of: moved.command + of["stiffness"] * _beyond(moved, of["position"])
    ),
    *DRIVE_INJECTIONS,
)
