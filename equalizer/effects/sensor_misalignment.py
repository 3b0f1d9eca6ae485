"""Sensor misalignment: a sensor mounted at an angle, whose readings are rotated.

Two or three channels are rotated together; two, about the axis perpendicular to both.
"""

import math

import numpy as np

from equalizer.effects.effect import Effect, OnResponse, Parameter, Values
from equalizer.effects.starts.evidence import Evidence
from equalizer.signals.signal import FloatArray

ANGLE_NAMES = ("about_x", "about_y", "about_z")
LARGEST_DEG = 120.0
"""Largest angle: below half a turn the rotation vector is unique."""
LEAST_DEG = 0.01
"""Least angle that is tried."""


def _rotate_response(
    response: FloatArray, sample_rate_hz: float, channels: tuple[int, ...], values: Values
) -> FloatArray:
    if len(channels) not in (2, 3):
        raise ValueError(f"sensor_misalignment turns two or three channels together, not {len(channels)}")
    rotation = _rotation_matrix(np.radians(_rotation_degrees(values)))
    read = response.copy()
    read[:, channels] = response[:, channels] @ rotation[: len(channels), : len(channels)].T
    return read


def _rotation_degrees(values: Values) -> list[float]:
    """Rotation vector, degrees about each axis; about the last axis where only the angle is known."""
    angles_deg = [values.get(name, 0.0) for name in ANGLE_NAMES]
    return angles_deg if any(name in values for name in ANGLE_NAMES) else [0.0, 0.0, values["degrees"]]


def _rotation_matrix(vector: FloatArray) -> FloatArray:
    """Rotation matrix of a rotation vector in radians (Rodrigues' formula)."""
    angle = float(np.linalg.norm(vector))
    x, y, z = vector / angle if angle > 0 else vector
    cross_product = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + np.sin(angle) * cross_product + (1 - np.cos(angle)) * cross_product @ cross_product)


def _rotation_vector(matrix: FloatArray) -> FloatArray:
    """Rotation vector in radians of a rotation matrix, for angles well below half a turn; zero for the identity."""
    axis_vector = np.array([matrix[2, 1] - matrix[1, 2], matrix[0, 2] - matrix[2, 0], matrix[1, 0] - matrix[0, 1]])
    twice_sine = float(np.linalg.norm(axis_vector))
    angle = math.atan2(twice_sine, float(np.trace(matrix)) - 1)
    return np.asarray(axis_vector * (angle / twice_sine if twice_sine > 0 else 0.5))


def _starts(evidence: Evidence, channel: int) -> tuple[Values, ...]:
    """The rotation that brings the predicted response closest to the measured one."""
    p = evidence.response.shape[1]
    if channel > 0 or p not in (2, 3):
        return ()
    used = evidence.used > 0
    predicted_xyz, measured_xyz = np.zeros((2, int(used.sum()), 3))
    predicted_xyz[:, :p], measured_xyz[:, :p] = evidence.predicted[used], evidence.response[used]
    left_vectors, _, right_vectors = np.linalg.svd(measured_xyz.T @ predicted_xyz)
    proper = np.diag([1.0, 1.0, np.linalg.det(left_vectors @ right_vectors)])
    vector = np.degrees(_rotation_vector(left_vectors @ proper @ right_vectors))
    if not LEAST_DEG < np.linalg.norm(vector) < LARGEST_DEG:
        return ()
    return (dict(zip(ANGLE_NAMES, vector.tolist(), strict=True)),)


def _report(values: Values) -> Values:
    angles_deg = {name: values[name] for name in ANGLE_NAMES if name in values}
    return {"degrees": math.hypot(*_rotation_degrees(values)), **angles_deg}


EFFECT = Effect(
    name="sensor_misalignment",
    equation="y = R x, R a rotation",
    source="Titterton and Weston, Strapdown Inertial Navigation Technology, IET 2004, ch. 8: mounting misalignment",
    signature="each channel reads a constant share of the others at every frequency and level, with opposite signs "
    "both ways, while the position agrees",
    parameters=tuple(
        Parameter(name, -LARGEST_DEG, LARGEST_DEG, none=0.0, scale="linear", step=0.05) for name in ANGLE_NAMES
    ),
    action=OnResponse(_rotate_response, stage=-2),
    starts=_starts,
    sites=("all",),
    report=_report,
)
