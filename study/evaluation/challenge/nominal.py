"""The model that a lab would have of the device: calibrated before, or re-tuned to what it recorded.

Calibrated: the bare bench, its mass, damping and stiffness at each driven axis off by one tight tolerance, normally
distributed. Re-tuned: these nine fitted to the response of the device as it is, at 1.5 N, so that they hide what they
can of the concealed effect; the tolerances are wide. Off-diagonals and modes are known in both.
"""

from dataclasses import replace

import numpy as np

from equalizer.plant.mechanical_model import MechanicalModel, SensorLimits, Tolerance
from equalizer.signals.signal import FloatArray
from study.evaluation.challenge.bench import Bench
from study.evaluation.challenge.device import Device, motion
from study.evaluation.challenge.drive_plan import AXES, LEVELS_N, RATE_HZ, DrivePlan
from study.evaluation.challenge.sensor import BANDWIDTH_HZ, NOISE_MPS2, RANGE_MPS2
from study.evaluation.challenge.sensor_kernel import one_pole

MODES_TOLERANCE = 0.005
WIDE = Tolerance(0.05, 3.0, 100.0, MODES_TOLERANCE)
ROUNDS, SLOPES_ANEW = 6, 2
DECIMALS = 8
"""Significant digits of the matrices in the file."""


def calibrated(bench: Bench, random: np.random.Generator, axes: tuple[int, ...] = (0, 1, 2)) -> tuple[Bench, Tolerance]:
    """The bench as its owner knows it, and how well. axes: those of which anything is unknown."""
    tolerance = Tolerance(
        mass_kg=float(np.diag(bench.mass).mean() * random.uniform(0.013, 0.022)),
        damping_n_s_per_m=float(np.diag(bench.damping).mean() * random.uniform(0.035, 0.09)),
        stiffness_n_per_m=float(np.diag(bench.stiffness).mean() * random.uniform(0.033, 0.075)),
        modes=MODES_TOLERANCE,
    )
    sizes = (tolerance.mass_kg, tolerance.damping_n_s_per_m, tolerance.stiffness_n_per_m)
    off = random.normal(size=9) * np.repeat(np.array(sizes, dtype=np.float64), 3)
    return shifted(bench, off * _of_axes(axes)), tolerance


def retuned(
    bench: Bench, response: FloatArray, plan: DrivePlan, axes: tuple[int, ...] = (0, 1, 2)
) -> tuple[Bench, Tolerance]:
    """The bench whose numbers at these axes, nine of three, fit the response (samples, 3) of the multisines at 1.5 N
    best."""
    parts = [s for s in plan.segments if s.role == "fit" and s.amplitude == LEVELS_N[1]]
    commands = [plan.command[s.start : s.stop] for s in parts]
    seen, free = list(axes), _of_axes(axes)
    noise = np.array(NOISE_MPS2)[seen]
    wanted = np.vstack([response[s.start : s.stop, seen] for s in parts]) / noise
    steps = np.repeat((1e-3, 1e-2, 1.0), 3)
    shift = np.zeros(9)

    def predicted(at: FloatArray) -> FloatArray:
        played = np.vstack([_linear_response(shifted(bench, at), command)[:, seen] for command in commands])
        return np.asarray(played / noise)

    slopes = np.zeros((wanted.size, 9))
    for turn in range(ROUNDS):
        here = predicted(shift)
        if turn < SLOPES_ANEW:
            each = [(predicted(shift + h * unit) - here).ravel() / h for h, unit in zip(steps, np.eye(9), strict=True)]
            slopes = np.column_stack(each) * free
        change = np.linalg.lstsq(slopes, (wanted - here).ravel(), rcond=None)[0]
        shift = _within(shift + change, bench)
        if np.abs(change / steps).max() < 0.05:
            break
    return shifted(bench, shift), WIDE


def shifted(bench: Bench, by: FloatArray) -> Bench:
    """by: (9,): kg, N s/m and N/m, of x, y, z each, added at the handle."""
    mass, damping, stiffness = (np.diag(part) for part in np.asarray(by).reshape(3, 3))
    return replace(
        bench, mass=bench.mass + mass, damping=bench.damping + damping, stiffness=bench.stiffness + stiffness
    )


def as_model(name: str, bench: Bench, tolerance: Tolerance, axes: tuple[int, ...] = (0, 1, 2)) -> MechanicalModel:
    """Values as they are written: 8 significant digits."""
    mass, damping, stiffness = (_rounded(matrix) for matrix in bench.matrices())
    seen = np.eye(len(AXES), len(mass))[list(axes)]
    return MechanicalModel(
        name, "acceleration", mass, damping, stiffness, seen.T, seen,
        sensor=SensorLimits(BANDWIDTH_HZ, RANGE_MPS2), tolerance=tolerance,
    )  # fmt: skip


def _of_axes(axes: tuple[int, ...]) -> FloatArray:
    """(9,): 1 for what belongs to these axes, else 0."""
    mask: FloatArray = np.array([float(axis in axes) for axis in range(3)] * 3)
    return mask


def _linear_response(bench: Bench, command: FloatArray) -> FloatArray:
    acceleration, _ = motion(Device(bench), command)
    smoothed: FloatArray = one_pole(acceleration, 1.0 - np.exp(-2 * np.pi * BANDWIDTH_HZ / RATE_HZ))
    return smoothed


def _within(shift: FloatArray, bench: Bench) -> FloatArray:
    """No lighter than half of the bench, and neither damping nor stiffness below a tenth."""
    lowest = np.concatenate(
        [-0.5 * np.diag(bench.mass), -0.9 * np.diag(bench.damping), -0.9 * np.diag(bench.stiffness)]
    )
    allowed: FloatArray = np.maximum(shift, lowest)
    return allowed


def _rounded(matrix: FloatArray) -> FloatArray:
    texts = [[f"{value:.{DECIMALS}g}" for value in row] for row in matrix]
    return np.array(texts, dtype=np.float64)
