"""A sensor that is mounted at an angle: what it reads is turned, lengths stay.

Two or three channels turn together; with two, about an axis that stands upright on both.
"""

import math

import numpy as np

from equalizer.effects.effect import Effect, OnResponse, Parameter, Values
from equalizer.effects.starts.evidence import Evidence
from equalizer.signals.signal import FloatArray

ABOUT = ("about_x", "about_y", "about_z")
LARGEST_DEG = 120.0
LEAST_DEG = 0.01


def _turned(response: FloatArray, sample_rate_hz: float, channels: tuple[int, ...], of: Values) -> FloatArray:
    if len(channels) not in (2, 3):
        raise ValueError(f"sensor_misalignment turns two or three channels together, not {len(channels)}")
    rotation = _matrix(np.radians(_vector(of)))
    read = response.copy()
    read[:, channels] = response[:, channels] @ rotation[: len(channels), : len(channels)].T
    return read


def _vector(of: Values) -> list[float]:
    """Degrees about each axis; about the last where only the angle is known."""
    about = [of.get(name, 0.0) for name in ABOUT]
    return about if any(name in of for name in ABOUT) else [0.0, 0.0, of["degrees"]]


def _matrix(vector: FloatArray) -> FloatArray:
    """Rodrigues' formula; radians."""
    angle = float(np.linalg.norm(vector))
    x, y, z = vector / angle if angle > 0 else vector
    across = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + np.sin(angle) * across + (1 - np.cos(angle)) * across @ across)


def _rotation_vector(matrix: FloatArray) -> FloatArray:
    """Its inverse, for angles well below half a turn; zero for none."""
    across = np.array([matrix[2, 1] - matrix[1, 2], matrix[0, 2] - matrix[2, 0], matrix[1, 0] - matrix[0, 1]])
    twice_sine = float(np.linalg.norm(across))
    angle = math.atan2(twice_sine, float(np.trace(matrix)) - 1)
    return np.asarray(across * (angle / twice_sine if twice_sine > 0 else 0.5))


def _starts(evidence: Evidence, channel: int) -> tuple[Values, ...]:
    """The rotation that brings the predicted response closest to the measured one."""
    p = evidence.response.shape[1]
    if channel > 0 or p not in (2, 3):
        return ()
    used = evidence.used > 0
    ours, theirs = np.zeros((2, int(used.sum()), 3))
    ours[:, :p], theirs[:, :p] = evidence.predicted[used], evidence.response[used]
    left, _, right = np.linalg.svd(theirs.T @ ours)
    handed = np.diag([1.0, 1.0, np.linalg.det(left @ right)])
    vector = np.degrees(_rotation_vector(left @ handed @ right))
    if not LEAST_DEG < np.linalg.norm(vector) < LARGEST_DEG:
        return ()
    return (dict(zip(ABOUT, vector.tolist(), strict=True)),)


def _report(of: Values) -> Values:
    return {"degrees": math.hypot(*_vector(of)), **{name: of[name] for name in ABOUT if name in of}}


EFFECT = Effect(
    name="sensor_misalignment",
    equation="y = R x, R a rotation",
    source="Titterton and Weston, Strapdown Inertial Navigation Technology, IET 2004, ch. 8: mounting misalignment",
    signature="each channel reads a constant share of the others at every frequency and level, with opposite signs "
    "both ways, while the position agrees",
    parameters=tuple(Parameter(name, -LARGEST_DEG, LARGEST_DEG, none=0.0, scale="linear", step=0.05) for name in ABOUT),
    acts=OnResponse(_turned, stage=-2, shared=True),
    starts=_starts,
    sites=("all",),
    report=_report,
)
