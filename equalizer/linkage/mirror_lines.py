"""Mirror symmetry of a delta linkage: test of calibration readings, and their completion by reflection.

The plane of each arm, which contains the base's axis x, is a plane of symmetry with the reflection R: at the mirrored
position the inertia is R M R, the Jacobian R J P and the joint angles P q, where P swaps the other two joints. A mirror
line is where such a plane meets the plane y-z. At a position in the plane, two directions that are mirror images have
the same apparent mass.
"""

import numpy as np

from equalizer.linkage.calibration import LinkageReading
from equalizer.signals.signal import FloatArray

LEAST_WARNED_ASYMMETRY = 0.02
"""Relative difference of inertia above which a warning is given. It changes an acceleration by 2 % (0.17 dB)."""

SAME_POSITION_M = 1e-6
"""Distance (m) below which two positions count as the same. Chosen above rounding errors."""
VALID_LINE_SHARE = 0.5
"""Fraction of the second smallest asymmetry below which the line with the smallest is named as valid, where only the
other two lines are warned of; the arm in the valid line is then the arm that differs from the others. Heuristic."""
LARGEST_UPRIGHT_COMPONENT = 1e-3
"""Largest magnitude of the y component of a line's direction for it to count as upright; its mirror plane then contains
the direction of gravity. Chosen above rounding errors."""


def compute_reflection(azimuth_rad: float) -> FloatArray:
    """Compute the reflection (3, 3) about the plane that contains the axis x and has this azimuth, from y towards z."""
    normal = np.array([0.0, -np.sin(azimuth_rad), np.cos(azimuth_rad)])
    mirror: FloatArray = np.eye(3) - 2 * np.outer(normal, normal)
    return mirror


def measure_line_asymmetry(readings: list[LinkageReading], azimuths_rad: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Measure the asymmetry of the inertia about each line, (3,): largest |M(R p) - R M(p) R| / |M(p)| (spectral norms)
    over the readings whose mirrored position was read too, 0 without any; and the positions (3, 3), m, where it is
    largest (zero where the asymmetry is 0). readings: at least one; azimuths_rad: (3,), of the lines."""
    largest_asymmetry, worst_positions_m = np.zeros(3), np.zeros((3, 3))
    positions_m = np.array([reading.position_m for reading in readings])
    for line, azimuth_rad in enumerate(azimuths_rad):
        reflection = compute_reflection(float(azimuth_rad))
        for reading in readings:
            mirrored_index = _find_same_position(positions_m, reflection @ reading.position_m)
            if mirrored_index is None:
                continue
            difference = readings[mirrored_index].inertia_kg - reflection @ reading.inertia_kg @ reflection
            asymmetry = float(np.linalg.norm(difference, 2) / np.linalg.norm(reading.inertia_kg, 2))
            if asymmetry > largest_asymmetry[line]:
                largest_asymmetry[line], worst_positions_m[line] = asymmetry, reading.position_m
    return largest_asymmetry, worst_positions_m


def complete_by_symmetry(
    readings: list[LinkageReading], azimuths_rad: FloatArray, unread_positions_m: FloatArray
) -> tuple[list[LinkageReading], FloatArray]:
    """Complete readings by symmetry: readings at those of the unread positions (k, 3), m, that one reflection, or two
    in succession, map to a position that was read; and the remaining positions (r, 3). Gravity is reflected about an
    upright line only, and NaN otherwise. readings: at least one; azimuths_rad: (3,), of the lines."""
    completed_readings, remaining_positions_m = [], []
    read_positions_m = np.array([reading.position_m for reading in readings])
    single_reflections = [(line,) for line in range(3)]
    for position_m in unread_positions_m:
        for reflected_lines in (
            *single_reflections,
            *((first, second) for first in range(3) for second in range(3) if first != second),
        ):
            image_position_m = position_m
            for line in reflected_lines:
                image_position_m = compute_reflection(float(azimuths_rad[line])) @ image_position_m
            source_index = _find_same_position(read_positions_m, image_position_m)
            if source_index is not None:
                image_reading = readings[source_index]
                for line in reversed(reflected_lines):
                    image_reading = _mirror_reading(image_reading, line, float(azimuths_rad[line]))
                completed_readings.append(image_reading)
                break
        else:
            remaining_positions_m.append(position_m)
    return completed_readings, np.array(remaining_positions_m).reshape(-1, 3)


def write_asymmetry_warnings(
    asymmetry: FloatArray, worst_positions_m: FloatArray, azimuths_deg: FloatArray
) -> tuple[str, ...]:
    """Write warnings, a sentence each, for lines whose asymmetry (3,) exceeds `LEAST_WARNED_ASYMMETRY`; empty if there
    are none. worst_positions_m: (3, 3), where each line's asymmetry is largest; azimuths_deg: (3,), of the lines."""
    warnings = [
        f"Mirrored about the line at {azimuths_deg[line]:.0f} degrees the inertia differs by up to "
        f"{asymmetry[line]:.1%}, most at ({', '.join(f'{1000 * x:.0f}' for x in worst_positions_m[line])}) mm; "
        f"up to {LEAST_WARNED_ASYMMETRY:.0%} is rounding and assembly."
        for line in range(3)
        if asymmetry[line] > LEAST_WARNED_ASYMMETRY
    ]
    ascending_order = np.argsort(asymmetry)
    if len(warnings) == 2 and asymmetry[ascending_order[0]] < VALID_LINE_SHARE * asymmetry[ascending_order[1]]:
        warnings.append(
            f"The line at {azimuths_deg[ascending_order[0]]:.0f} degrees is a line of symmetry and "
            "the other two are not: the arm in that line differs from the others. "
            "Directions mirrored about that line still have the same apparent mass."
        )
    return tuple(warnings)


def _find_same_position(positions_m: FloatArray, target_m: FloatArray) -> int | None:
    """Find the index of the position, of (n, 3) with n >= 1, that equals `target_m` (3,) within `SAME_POSITION_M`; None
    without one."""
    distances_m = np.linalg.norm(positions_m - target_m, axis=1)
    nearest_index = int(np.argmin(distances_m))
    return nearest_index if distances_m[nearest_index] < SAME_POSITION_M else None


def _mirror_reading(reading: LinkageReading, line: int, azimuth_rad: float) -> LinkageReading:
    """Reflect a reading about a mirror line: returns the reading at the mirrored position. line: index of the arm in
    that plane."""
    reflection = compute_reflection(azimuth_rad)
    joint_order = [line if joint == line else 3 - line - joint for joint in range(3)]
    is_upright = abs(np.cos(azimuth_rad)) < LARGEST_UPRIGHT_COMPONENT
    return LinkageReading(
        position_m=reflection @ reading.position_m,
        joint_angle_rad=reading.joint_angle_rad[joint_order],
        jacobian=(reflection @ reading.jacobian)[:, joint_order],
        inertia_kg=reflection @ reading.inertia_kg @ reflection,
        gravity_n=reflection @ reading.gravity_n if is_upright else np.full(3, np.nan),
    )
