"""Readings of an invented linkage whose Jacobian and inertia are formulas of the position: no delta device's own, but
with a delta's three mirror lines."""

import math

import numpy as np

from equalizer.linkage.calibration import LinkageCalibration, LinkageReading
from equalizer.linkage.grid import estimate_arm_azimuths, make_symmetric_grid
from equalizer.signals.signal import FloatArray

ARMS_DEG = np.array([90.0, 210.0, 330.0])


def rates(position_m: FloatArray, arms_deg: FloatArray = ARMS_DEG) -> FloatArray:
    """(3, 3), rad/m: each arm's row lies in its plane, and changes with the position along the arm and x."""
    rows = []
    for azimuth in np.radians(arms_deg):
        outwards = np.array([0.0, math.cos(azimuth), math.sin(azimuth)])
        along = float(position_m @ outwards)
        rows.append((7.0 + 20.0 * position_m[0]) * np.array([1.0, 0, 0]) - (9.0 + 30.0 * along) * outwards)
    return np.array(rows)


def reading(position_m: FloatArray, weights: FloatArray | None = None) -> LinkageReading:
    """weights: (3,), of the arms, kg m²."""
    turning = rates(position_m)
    arms = np.diag([1e-3] * 3 if weights is None else weights)
    inertia = 0.2 * np.eye(3) + turning.T @ arms @ turning
    angles = turning @ position_m
    return LinkageReading(position_m, angles, np.linalg.inv(turning), inertia, np.array([0.0, 0.0, 2.0]))


def readings(weights: FloatArray | None = None) -> list[LinkageReading]:
    centre = reading(np.zeros(3)).jacobian
    return [reading(position, weights) for position in make_symmetric_grid(estimate_arm_azimuths(centre), 0.05, 0.04)]


def calibration(of: list[LinkageReading], **changed: object) -> LinkageCalibration:
    values: dict[str, object] = {
        "device": "invented",
        "details": "",
        "read_on": "2026-11-27",
        "position_m": np.stack([each.position_m for each in of]),
        "joint_angle_rad": np.stack([each.joint_angle_rad for each in of]),
        "jacobian": np.stack([each.jacobian for each in of]),
        "inertia_kg": np.stack([each.inertia_kg for each in of]),
        "gravity_n": np.stack([each.gravity_n for each in of]),
        "filled": np.zeros(len(of)),
        "line_deg": ARMS_DEG,
        "asymmetry": np.zeros(3),
        "difference": 0.0,
    }
    return LinkageCalibration(**(values | changed))  # type: ignore[arg-type]
