"""Sensor misalignment: a sensor mounted at an angle, whose readings are rotated.

    y = R x,    R the rotation of a rotation vector (degrees about x, y, z)

Three channels are rotated; of two channels, the readings are the first two components of the rotated vector whose third
component is 0: a rotation where R is about the axis perpendicular to both. An entry of `equalizer.effects.catalogue`.
"""

import math

import numpy as np

from equalizer.effects.effect import Effect, OnResponse, Parameter, Values
from equalizer.effects.starts.evidence import Evidence
from equalizer.signals.signal import FloatArray

ANGLE_NAMES = ("about_x", "about_y", "about_z")
"""Parameters: components of the rotation vector, in degrees."""
LARGEST_ANGLE_DEG = 120.0
"""Largest angle of starting values, and largest component in a fit (degrees). Chosen: below half a turn, where the
rotation vector is unique."""
LEAST_ANGLE_DEG = 0.01
"""Angle (degrees) that must be exceeded for the effect to be tried. Chosen: it adds 0.02 % of a channel to another."""


def _rotate_response(
    response: FloatArray, sample_rate_hz: float, channels: tuple[int, ...], values: Values
) -> FloatArray:
    """Rotate these channels of the response (n, p): `OnResponse.change` of this effect. Raises ValueError unless there
    are two or three."""
    if len(channels) not in (2, 3):
        raise ValueError(f"sensor_misalignment turns two or three channels together, not {len(channels)}")
    rotation = _compute_rotation_matrix(np.radians(_read_rotation_vector(values)))
    rotated_response = response.copy()
    rotated_response[:, channels] = response[:, channels] @ rotation[: len(channels), : len(channels)].T
    return rotated_response


def _read_rotation_vector(values: Values) -> list[float]:
    """Read the rotation vector, degrees about each axis; about the last axis where only the angle `degrees` is known,
    as in a model file."""
    angles_deg = [values.get(name, 0.0) for name in ANGLE_NAMES]
    return angles_deg if any(name in values for name in ANGLE_NAMES) else [0.0, 0.0, values["degrees"]]


def _compute_rotation_matrix(vector: FloatArray) -> FloatArray:
    """Compute the rotation matrix (3, 3) of a rotation vector in radians (Rodrigues' formula)."""
    angle = float(np.linalg.norm(vector))
    x, y, z = vector / angle if angle > 0 else vector
    cross_product_matrix = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(
        np.eye(3)
        + np.sin(angle) * cross_product_matrix
        + (1 - np.cos(angle)) * cross_product_matrix @ cross_product_matrix
    )


def _compute_rotation_vector(matrix: FloatArray) -> FloatArray:
    """Compute the rotation vector (3,) in radians of a rotation matrix, for angles well below half a turn; zero for the
    identity."""
    axis_vector = np.array([matrix[2, 1] - matrix[1, 2], matrix[0, 2] - matrix[2, 0], matrix[1, 0] - matrix[0, 1]])
    twice_sine = float(np.linalg.norm(axis_vector))
    angle = math.atan2(twice_sine, float(np.trace(matrix)) - 1)
    return np.asarray(axis_vector * (angle / twice_sine if twice_sine > 0 else 0.5))  # 0.5: the limit for small angles


def _find_starting_values(evidence: Evidence, channel: int) -> tuple[Values, ...]:
    """Find the rotation that brings the predicted response closest to the measured one (Kabsch 1976, Acta
    Crystallographica A32:922). Empty unless there are two or three channels, where the angle is too small or too large,
    and for a channel other than the first: all are rotated together."""
    channel_count = evidence.response.shape[1]
    if channel > 0 or channel_count not in (2, 3):
        return ()
    is_used = evidence.used > 0
    predicted_xyz, measured_xyz = np.zeros((2, int(is_used.sum()), 3))
    predicted_xyz[:, :channel_count], measured_xyz[:, :channel_count] = (
        evidence.predicted[is_used],
        evidence.response[is_used],
    )
    left_vectors, _, right_vectors = np.linalg.svd(measured_xyz.T @ predicted_xyz)
    reflection_correction = np.diag([1.0, 1.0, np.linalg.det(left_vectors @ right_vectors)])
    rotation_vector_deg = np.degrees(_compute_rotation_vector(left_vectors @ reflection_correction @ right_vectors))
    if not LEAST_ANGLE_DEG < np.linalg.norm(rotation_vector_deg) < LARGEST_ANGLE_DEG:
        return ()
    return (dict(zip(ANGLE_NAMES, rotation_vector_deg.tolist(), strict=True)),)


def _report_angle(values: Values) -> Values:
    """Add the angle of the rotation, `degrees`, which the vocabulary reports, to the values: `Effect.report`."""
    angles_deg = {name: values[name] for name in ANGLE_NAMES if name in values}
    # A rotation vector beyond half a turn is the smaller rotation the other way round.
    return {"degrees": abs(math.remainder(math.hypot(*_read_rotation_vector(values)), 360.0)), **angles_deg}


EFFECT = Effect(
    name="sensor_misalignment",
    equation="y = R x, R a rotation",
    source="Titterton and Weston, Strapdown Inertial Navigation Technology, IET 2004, ch. 8: mounting misalignment",
    signature="each channel reads a constant share of the others at every frequency and level, with opposite signs "
    "both ways, while the position agrees",
    parameters=tuple(
        Parameter(name, -LARGEST_ANGLE_DEG, LARGEST_ANGLE_DEG, none=0.0, scale="linear", step=0.05)
        for name in ANGLE_NAMES
    ),
    action=OnResponse(_rotate_response, stage=-2),
    starts=_find_starting_values,
    sites=("all",),
    report=_report_angle,
)
