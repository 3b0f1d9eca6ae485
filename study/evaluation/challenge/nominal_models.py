"""Nominal models of the challenge: the model of a device, without the concealed effect, that the diagnosis is given.

Calibrated model: mass, damping and stiffness of the bench without the effect, at each of the driven axes, with
independent normal errors whose standard deviation is the stated tolerance (a few per cent). Re-tuned model: these
parameters are fitted by `retune` to the response of the true device at 1.5 N, so that they absorb as much of the
concealed effect as they can; the stated tolerances are wide. Off-diagonal elements and modes are those of the bench in
both, but for rounding.
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
"""Relative tolerance (standard deviation) of the modes, stated by every model of the challenge. Chosen."""
RETUNED_TOLERANCE = Tolerance(0.05, 3.0, 100.0, MODES_TOLERANCE)
"""Tolerance (standard deviations) of a re-tuned model: mass (kg), damping (N s/m), stiffness (N/m), modes. Chosen."""
MAX_ITERATIONS, JACOBIAN_UPDATES = 6, 2
"""Maximum number of Gauss-Newton iterations of the re-tuning, and number of first iterations in which the Jacobian is
computed; later iterations use the last one. Chosen."""
SIGNIFICANT_DIGITS = 8
"""Number of significant digits of the matrices in the model file. Chosen."""


def draw_calibration(
    bench: Bench, random: np.random.Generator, axes: tuple[int, ...] = (0, 1, 2)
) -> tuple[Bench, Tolerance]:
    """Draw calibration errors: returns the bench with them, and the tolerance that the model states. The tolerances are
    drawn uniformly: 1.3 to 2.2 % of the mean diagonal mass, 3.5 to 9 % of damping, 3.3 to 7.5 % of stiffness (chosen).
    axes: those whose parameters have errors."""
    tolerance = Tolerance(
        mass_kg=float(np.diag(bench.mass).mean() * random.uniform(0.013, 0.022)),
        damping_n_s_per_m=float(np.diag(bench.damping).mean() * random.uniform(0.035, 0.09)),
        stiffness_n_per_m=float(np.diag(bench.stiffness).mean() * random.uniform(0.033, 0.075)),
        modes=MODES_TOLERANCE,
    )
    standard_deviations = (tolerance.mass_kg, tolerance.damping_n_s_per_m, tolerance.stiffness_n_per_m)
    parameter_errors = random.normal(size=9) * np.repeat(np.array(standard_deviations, dtype=np.float64), 3)
    return shift_diagonals(bench, parameter_errors * _make_axes_mask(axes)), tolerance


def retune(
    bench: Bench, response: FloatArray, plan: DrivePlan, axes: tuple[int, ...] = (0, 1, 2)
) -> tuple[Bench, Tolerance]:
    """Fit the diagonals of mass, damping and stiffness at these axes to the response to the multisines at 1.5 N;
    returns the fitted bench and `RETUNED_TOLERANCE`. response: (samples, 3), m/s^2; its residuals are divided by the
    sensor noise. Gauss-Newton with forward differences, at most `MAX_ITERATIONS` steps, until every change is below a
    twentieth of its difference step (chosen); after each step `_limit_shift` limits the sum of the changes."""
    fit_segments = [segment for segment in plan.segments if segment.role == "fit" and segment.amplitude == LEVELS_N[1]]
    commands = [plan.command[segment.start : segment.stop] for segment in fit_segments]
    channels, axes_mask = list(axes), _make_axes_mask(axes)
    noise = np.array(NOISE_MPS2)[channels]
    measured_response = (
        np.vstack([response[segment.start : segment.stop, channels] for segment in fit_segments]) / noise
    )
    # Steps of the forward differences, chosen: kg, N s/m, N/m, for three axes each.
    difference_steps = np.repeat((1e-3, 1e-2, 1.0), 3)
    shift = np.zeros(9)

    def predict_response(trial_shift: FloatArray) -> FloatArray:
        """Predict the response (samples of the segments, channels), divided by the noise, with a shift (9,)."""
        responses = np.vstack(
            [
                _simulate_linear_response(shift_diagonals(bench, trial_shift), command)[:, channels]
                for command in commands
            ]
        )
        return np.asarray(responses / noise)

    jacobian = np.zeros((measured_response.size, 9))
    for iteration in range(MAX_ITERATIONS):
        prediction = predict_response(shift)
        if iteration < JACOBIAN_UPDATES:
            columns = [
                (predict_response(shift + difference_step * unit_vector) - prediction).ravel() / difference_step
                for difference_step, unit_vector in zip(difference_steps, np.eye(9), strict=True)
            ]
            jacobian = np.column_stack(columns) * axes_mask
        shift_change = np.linalg.lstsq(jacobian, (measured_response - prediction).ravel(), rcond=None)[0]
        shift = _limit_shift(shift + shift_change, bench)
        if np.abs(shift_change / difference_steps).max() < 0.05:
            break
    return shift_diagonals(bench, shift), RETUNED_TOLERANCE


def shift_diagonals(bench: Bench, changes: FloatArray) -> Bench:
    """Add changes to the diagonals of mass, damping and stiffness at the handle; returns a new bench. changes: (9,), in
    kg, N s/m and N/m, for x, y, z each."""
    mass_change, damping_change, stiffness_change = (np.diag(values) for values in np.asarray(changes).reshape(3, 3))
    return replace(
        bench,
        mass=bench.mass + mass_change,
        damping=bench.damping + damping_change,
        stiffness=bench.stiffness + stiffness_change,
    )


def make_model(name: str, bench: Bench, tolerance: Tolerance, axes: tuple[int, ...] = (0, 1, 2)) -> MechanicalModel:
    """Make the mechanical model of a bench for the file, with matrices of `SIGNIFICANT_DIGITS` significant digits,
    driven and measured at these axes, with the limits of the sensor and the tolerance."""
    mass, damping, stiffness = (_round_significant(matrix) for matrix in bench.assemble_matrices())
    selection = np.eye(len(AXES), len(mass))[list(axes)]
    return MechanicalModel(
        name, "acceleration", mass, damping, stiffness, selection.T, selection,
        sensor=SensorLimits(BANDWIDTH_HZ, RANGE_MPS2), tolerance=tolerance,
    )  # fmt: skip


def _make_axes_mask(axes: tuple[int, ...]) -> FloatArray:
    """Make the mask (9,): 1 for the parameters of these axes, otherwise 0."""
    mask: FloatArray = np.array([float(axis in axes) for axis in range(3)] * 3)
    return mask


def _simulate_linear_response(bench: Bench, command: FloatArray) -> FloatArray:
    """Simulate the acceleration (samples, 3) of the bench, m/s^2, after the first-order low-pass filter of the sensor.
    command: (samples, 3), N."""
    acceleration, _ = simulate_motion(Device(bench), command)
    smoothed: FloatArray = filter_first_order(acceleration, 1.0 - np.exp(-2 * np.pi * BANDWIDTH_HZ / RATE_HZ))
    return smoothed


def _limit_shift(shift: FloatArray, bench: Bench) -> FloatArray:
    """Limit the shift (9,) of the diagonals so that at least half of each mass and a tenth of each damping and
    stiffness remain (chosen)."""
    lower_bound = np.concatenate(
        [-0.5 * np.diag(bench.mass), -0.9 * np.diag(bench.damping), -0.9 * np.diag(bench.stiffness)]
    )
    limited_shift: FloatArray = np.maximum(shift, lower_bound)
    return limited_shift


def _round_significant(matrix: FloatArray) -> FloatArray:
    """Round the entries of a matrix to `SIGNIFICANT_DIGITS` significant digits."""
    rounded_texts = [[f"{value:.{SIGNIFICANT_DIGITS}g}" for value in row] for row in matrix]
    return np.array(rounded_texts, dtype=np.float64)
