"""Symmetric grid of positions for the calibration of a delta linkage, and a test of its Jacobian by finite differences.

The azimuths of the arms, estimated from the Jacobian, give the planes of mirror symmetry; the grid is made so that
reflection about each of them maps it onto itself. Axes as in the whole package: x from the base towards the operator,
y to the right, z up. Azimuths are angles from y towards z. Called by `study.workflows.recording.calibrate_linkage`.
"""

import math

import numpy as np

from equalizer.linkage.calibration import CalibrationError
from equalizer.signals.signal import FloatArray

DIFFERENCE_STEP_M = 2e-3
"""Step (m) of the central differences: about 200 encoder counts, so that the resolution of the encoder is negligible,
and small against the length of an arm. Chosen."""

LARGEST_AZIMUTH_ERROR_DEG = 5.0
"""Largest deviation (degrees) of an arm's azimuth from three azimuths at 120 degrees to each other. Heuristic."""


def estimate_arm_azimuths(jacobian: FloatArray) -> FloatArray:
    """Estimate the azimuths (3,) of the arms, rad, in the order of the joints, from J (3, 3) at a position on the
    base's axis; not singular (`check_reading`).

    There each row of the inverse of J is parallel to its forearm, in the plane of its arm; forearms point inwards and
    towards the operator. The result is the nearest triple at exactly 120 degrees to each other. Raises CalibrationError
    where an azimuth deviates from it by more than `LARGEST_AZIMUTH_ERROR_DEG`, or two arms share one.
    """
    inverse_rows = np.linalg.inv(jacobian)
    inverse_rows = inverse_rows * np.sign(inverse_rows[:, :1])
    arm_directions = np.arctan2(-inverse_rows[:, 2], -inverse_rows[:, 1])
    mean_rotation = np.angle(np.exp(3j * arm_directions).mean()) / 3
    sector_indices = np.round((arm_directions - mean_rotation) / (2 * math.pi / 3))
    ideal_directions = mean_rotation + sector_indices * 2 * math.pi / 3
    deviation_deg = np.degrees(np.abs(arm_directions - ideal_directions)).max()
    if len(set(sector_indices.astype(int) % 3)) < 3 or deviation_deg > LARGEST_AZIMUTH_ERROR_DEG:
        azimuths_text = ", ".join(f"{azimuth:.0f}" for azimuth in np.degrees(arm_directions))
        raise CalibrationError(
            (f"the arms lie at {azimuths_text} degrees; those of a delta device are 120 degrees apart",)
        )
    azimuths: FloatArray = np.angle(np.exp(1j * ideal_directions))
    return azimuths


def make_symmetric_grid(azimuths_rad: FloatArray, radius_m: float, depth_m: float) -> FloatArray:
    """Make the grid, (185, 3), m: twelve directions at three radii up to radius_m, and the axis, in five planes at
    depths (x) of -depth_m to depth_m; numbers chosen. The first point is the centre.

    The directions are multiples of 30 degrees from the first arm, so that the reflection about each arm's plane maps
    the grid onto itself. azimuths_rad: (3,), of the arms.
    """
    points = [(0.0, 0.0, 0.0)]
    for depth_position_m in np.linspace(-depth_m, depth_m, 5):
        if depth_position_m:
            points.append((float(depth_position_m), 0.0, 0.0))
        for ring_radius_m in radius_m * np.array([1, 2, 3]) / 3:
            for direction_index in range(12):
                azimuth_rad = azimuths_rad[0] + direction_index * math.pi / 6
                points.append(
                    (
                        float(depth_position_m),
                        float(ring_radius_m * math.cos(azimuth_rad)),
                        float(ring_radius_m * math.sin(azimuth_rad)),
                    )
                )
    return np.array(points)


def list_difference_positions(position_m: FloatArray) -> FloatArray:
    """List positions (6, 3), m: a step `DIFFERENCE_STEP_M` forwards along x, y and z, then a step backwards; for
    `compute_difference_error`."""
    steps: FloatArray = DIFFERENCE_STEP_M * np.vstack([np.eye(3), -np.eye(3)])
    return position_m + steps


def compute_difference_error(jacobian: FloatArray, positions_m: FloatArray, angles_rad: FloatArray) -> float:
    """Compute the largest difference between an entry of J (3, 3) and that of d position / d angle by central
    differences, relative to the largest entry of the latter. positions_m, angles_rad: (6, 3), at the positions of
    `list_difference_positions`."""
    position_steps, angle_steps = positions_m[:3] - positions_m[3:], angles_rad[:3] - angles_rad[3:]
    difference_jacobian = np.linalg.lstsq(angle_steps, position_steps, rcond=None)[0].T
    return float(np.abs(jacobian - difference_jacobian).max() / np.abs(difference_jacobian).max())
