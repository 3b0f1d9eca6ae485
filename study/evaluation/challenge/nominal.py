"""The nominal models of the challenge: what a laboratory would know of a device whose missing effect is concealed.

Calibrated model: mass, damping and stiffness of the bench without the effect, at each of three driven axes, with
independent normal errors whose standard deviation is the stated, tight tolerance. Re-tuned model: these nine parameters
are fitted by `retune` to the response of the true device at 1.5 N, so that they absorb as much of the concealed effect
as they can; the stated tolerances are wide. Off-diagonal elements and modes are exact in both.
"""

from dataclasses import replace

import numpy as np

from equalizer.plant.mechanical_model import MechanicalModel, SensorLimits, Tolerance
from equalizer.signals.signal import FloatArray
from study.evaluation.challenge.bench import Bench
from study.evaluation.challenge.device import Device, simulate_motion
from study.evaluation.challenge.drive_plan import AXES, LEVELS_N, RATE_HZ, DrivePlan
from study.evaluation.challenge.sensor import BANDWIDTH_HZ, NOISE_MPS2, RANGE_MPS2
from study.evaluation.challenge.sensor_kernel import filter_first_order

MODES_TOLERANCE = 0.005
"""Relative tolerance (standard deviation) of the modes, stated by every model of the challenge."""
RETUNED_TOLERANCE = Tolerance(0.05, 3.0, 100.0, MODES_TOLERANCE)
"""Tolerance of a re-tuned model: mass (kg), damping (N s/m), stiffness (N/m), modes."""
MAX_ITERATIONS, JACOBIAN_UPDATES = 6, 2
"""Most Gauss-Newton iterations of the re-tuning, and the number of first iterations in which the Jacobian is
recomputed."""
SIGNIFICANT_DIGITS = 8
"""Significant digits of the matrices in the model file."""


def draw_calibration(
    bench: Bench, random: np.random.Generator, axes: tuple[int, ...] = (0, 1, 2)
) -> tuple[Bench, Tolerance]:
    """The bench with calibration errors, and the tolerance that the model states. The tolerances are drawn evenly: 1.3
    to 2.2 % of the mean mass, 3.5 to 9 % of the mean damping, 3.3 to 7.5 % of the mean stiffness. axes: those whose
    parameters have errors."""
    tolerance = Tolerance(
        mass_kg=float(np.diag(bench.mass).mean() * random.uniform(0.013, 0.022)),
        damping_n_s_per_m=float(np.diag(bench.damping).mean() * random.uniform(0.035, 0.09)),
        stiffness_n_per_m=float(np.diag(bench.stiffness).mean() * random.uniform(0.033, 0.075)),
        modes=MODES_TOLERANCE,
    )
    deviations = (tolerance.mass_kg, tolerance.damping_n_s_per_m, tolerance.stiffness_n_per_m)
    errors = random.normal(size=9) * np.repeat(np.array(deviations, dtype=np.float64), 3)
    return shift_diagonals(bench, errors * _make_axes_mask(axes)), tolerance


def retune(
    bench: Bench, response: FloatArray, plan: DrivePlan, axes: tuple[int, ...] = (0, 1, 2)
) -> tuple[Bench, Tolerance]:
    """The bench whose mass, damping and stiffness at these axes best fit the response to the multisines at 1.5 N, and
    the tolerance `RETUNED_TOLERANCE`. response: (samples, 3), m/s^2; its residuals are divided by the sensor noise.
    Gauss-Newton with forward differences, at most `MAX_ITERATIONS` steps, until every change is below a twentieth of
    its difference step."""
    fit_segments = [segment for segment in plan.segments if segment.role == "fit" and segment.amplitude == LEVELS_N[1]]
    commands = [plan.command[segment.start : segment.stop] for segment in fit_segments]
    channels, axes_mask = list(axes), _make_axes_mask(axes)
    noise = np.array(NOISE_MPS2)[channels]
    measured = np.vstack([response[segment.start : segment.stop, channels] for segment in fit_segments]) / noise
    # Difference steps: kg, N s/m, N/m, for three axes each.
    difference_steps = np.repeat((1e-3, 1e-2, 1.0), 3)
    shift = np.zeros(9)

    def predict(trial_shift: FloatArray) -> FloatArray:
        responses = np.vstack(
            [
                _simulate_linear_response(shift_diagonals(bench, trial_shift), command)[:, channels]
                for command in commands
            ]
        )
        return np.asarray(responses / noise)

    jacobian = np.zeros((measured.size, 9))
    for iteration in range(MAX_ITERATIONS):
        prediction = predict(shift)
        if iteration < JACOBIAN_UPDATES:
            columns = [
                (predict(shift + difference_step * unit_vector) - prediction).ravel() / difference_step
                for difference_step, unit_vector in zip(difference_steps, np.eye(9), strict=True)
            ]
            jacobian = np.column_stack(columns) * axes_mask
        change = np.linalg.lstsq(jacobian, (measured - prediction).ravel(), rcond=None)[0]
        shift = _limit_shift(shift + change, bench)
        if np.abs(change / difference_steps).max() < 0.05:
            break
    return shift_diagonals(bench, shift), RETUNED_TOLERANCE


def shift_diagonals(bench: Bench, changes: FloatArray) -> Bench:
    """The bench with the diagonals of mass, damping and stiffness at the handle changed. changes: (9,): changes in kg,
    N s/m and N/m, for x, y, z each."""
    mass, damping, stiffness = (np.diag(values) for values in np.asarray(changes).reshape(3, 3))
    return replace(
        bench, mass=bench.mass + mass, damping=bench.damping + damping, stiffness=bench.stiffness + stiffness
    )


def as_model(name: str, bench: Bench, tolerance: Tolerance, axes: tuple[int, ...] = (0, 1, 2)) -> MechanicalModel:
    """The mechanical model as it is written to the file, with `SIGNIFICANT_DIGITS` significant digits: driven and
    measured at these axes, with the limits of the sensor and the tolerance."""
    mass, damping, stiffness = (_round_significant(matrix) for matrix in bench.assemble_matrices())
    selection = np.eye(len(AXES), len(mass))[list(axes)]
    return MechanicalModel(
        name, "acceleration", mass, damping, stiffness, selection.T, selection,
        sensor=SensorLimits(BANDWIDTH_HZ, RANGE_MPS2), tolerance=tolerance,
    )  # fmt: skip


def _make_axes_mask(axes: tuple[int, ...]) -> FloatArray:
    """(9,): 1 for the parameters of these axes, otherwise 0."""
    mask: FloatArray = np.array([float(axis in axes) for axis in range(3)] * 3)
    return mask


def _simulate_linear_response(bench: Bench, command: FloatArray) -> FloatArray:
    """(samples, 3): acceleration of the bench, m/s^2, behind the sensor's first-order low pass. command: (samples, 3),
    N."""
    acceleration, _ = simulate_motion(Device(bench), command)
    smoothed: FloatArray = filter_first_order(acceleration, 1.0 - np.exp(-2 * np.pi * BANDWIDTH_HZ / RATE_HZ))
    return smoothed


def _limit_shift(shift: FloatArray, bench: Bench) -> FloatArray:
    """The shift (9,), limited so that at least half of the mass and a tenth of damping and stiffness remain."""
    lower_bound = np.concatenate(
        [-0.5 * np.diag(bench.mass), -0.9 * np.diag(bench.damping), -0.9 * np.diag(bench.stiffness)]
    )
    limited_shift: FloatArray = np.maximum(shift, lower_bound)
    return limited_shift


def _round_significant(matrix: FloatArray) -> FloatArray:
    """The matrix rounded to `SIGNIFICANT_DIGITS` significant digits."""
    texts = [[f"{value:.{SIGNIFICANT_DIGITS}g}" for value in row] for row in matrix]
    return np.array(texts, dtype=np.float64)
