"""Fit a rigid model, with one body per command, by least squares on forces along the measured motion (inverse
dynamics).

    f = M q'' + D q' + K q + f0        f, q: (samples, m) commands and measured motion, low-pass filtered alike

The fitted matrices are made symmetric. K is kept only where it reduces the misfit by `SPRING_SHARE`. D and K that are
not positive semidefinite are replaced, so that the model is passive, and the masses have a lower bound. Rigid robots
are identified by the same regression: Gautier, Vandanjon and Pressé, Proc. IEEE Conf. Decision and Control 1994. For
recordings without a given model: in closed loop, where a controller would bias frequency responses from commands to
motions, of an imposed motion, or where a fit to frequency responses fails."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from analysis.diagnosis.data.closed_loop import is_in_closed_loop
from analysis.diagnosis.data.measured_motion import has_motion
from analysis.diagnosis.data.observed_parts import observe_parts
from analysis.diagnosis.forces.force_measure import build_predicted_force_measure
from analysis.diagnosis.forces.inverse_dynamics import compute_required_force
from analysis.diagnosis.forces.predicted_force import PredictedForce
from analysis.diagnosis.limits import MASSLESS_SHARE, RIGID_MASS_SHARE, RIGID_SHARE, SPRING_SHARE
from analysis.diagnosis.noise.noise_floor import estimate_noise_floor
from equalizer.plant.mechanical_model import DERIVATIVE_OF_QUANTITY, MechanicalModel, MechanicalModelError, Tolerance
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray

_FIT_COUNT = 2
"""Number of fits: the band in which forces are compared depends on the model, so the second fit uses the band of the
first model. Chosen."""


def should_use_rigid_model(recordings: Sequence[Recording]) -> bool:
    """Whether a rigid model can be fitted and is preferred, because in a recording a controller made the commands or a
    motion was imposed."""
    return can_be_rigid(recordings) and any(
        is_in_closed_loop(recording) or recording.meta.get("imposed") for recording in recordings
    )


def can_be_rigid(recordings: Sequence[Recording]) -> bool:
    """Whether, in every recording, one position or velocity was measured for each command, and all responses are of the
    same derivative of the position."""
    return all(_is_motion_paired(recording) for recording in recordings)


def fit_rigid_model(recordings: Sequence[Recording], name: str) -> MechanicalModel:
    """Fit the model with one body per command to at least one recording. Raises MechanicalModelError where the fitted
    mass matrix is not positive definite, or where no motion was measured; numpy.linalg.LinAlgError where a fit or an
    eigenvalue computation fails."""
    model = _make_unit_mass_model(recordings[0], name)
    records = observe_parts(recordings, model.outputs)
    if not all(has_motion(record.recording, model) for record in records):
        raise MechanicalModelError(("neither positions nor velocities were measured",))
    floors = [estimate_noise_floor(record.recording) for record in records]
    for _ in range(_FIT_COUNT):
        model = _fit_to_forces(model, build_predicted_force_measure(records, model, floors).measure)
    return model


def _is_motion_paired(recording: Recording) -> bool:
    """Whether there is one response per command, all responses are of one derivative of the position (an unknown
    quantity counts as acceleration), and a position or velocity was measured for each."""
    derivative_orders = [DERIVATIVE_OF_QUANTITY.get(quantity, 2) for quantity in recording.response.quantities]
    is_paired = len(recording.command.channels) == len(recording.response.channels)
    motion = recording.position if max(derivative_orders) == 2 else recording.response
    return (
        is_paired
        and len(set(derivative_orders)) == 1
        and motion is not None
        and len(motion.channels) == len(derivative_orders)
    )


def _make_unit_mass_model(recording: Recording, name: str) -> MechanicalModel:
    """Make the model that gives the band of the first fit: unit masses without dampers and springs."""
    identity = np.eye(len(recording.command.channels))
    return MechanicalModel(
        name,
        recording.response.quantities[0],
        identity,
        0 * identity,
        0 * identity,
        identity,
        identity,
        rotational=recording.is_rotational,
    )


def _fit_to_forces(model: MechanicalModel, measure: PredictedForce) -> MechanicalModel:
    """Fit mass, damping and stiffness to the measured forces, make the model passive, and state its tolerances: the
    shares `RIGID_MASS_SHARE` and `RIGID_SHARE` of the largest diagonal entries. measure: records and motions of the
    fit."""
    regressor_blocks, target_blocks = [], []
    for record, motion in zip(measure.records, measure.motions, strict=True):
        motion_and_force = compute_required_force(model, motion)
        is_used = record.fit | record.choose
        columns = (
            motion_and_force.axis_acceleration,
            motion_and_force.axis_velocity,
            motion_and_force.axis_position,
            np.ones((len(is_used), 1)),
        )
        regressor_blocks.append(np.hstack(columns)[is_used])
        target_blocks.append(record.measured[is_used])
    regressors, target, m = np.vstack(regressor_blocks), np.vstack(target_blocks), model.inputs
    full_fit, full_error = _solve_least_squares(regressors, target)
    springless_fit, springless_error = _solve_least_squares(np.delete(regressors, range(2 * m, 3 * m), axis=1), target)
    has_springs = full_error < (1 - SPRING_SHARE) * springless_error
    mass, damping = (
        (matrix + matrix.T) / 2 for matrix in (full_fit if has_springs else springless_fit)[: 2 * m].reshape(2, m, m)
    )
    mass = mass + np.diag(np.maximum(_compute_least_mass(regressors[:, :m], target) - np.diagonal(mass), 0.0))
    stiffness = (full_fit[2 * m : 3 * m] + full_fit[2 * m : 3 * m].T) / 2 if has_springs else np.zeros((m, m))
    # A linear model must be passive: of damping that is not positive semidefinite only positive diagonal entries are
    # kept, and such stiffness is dropped.
    damping = damping if np.linalg.eigvalsh(damping)[0] >= 0 else np.diag(np.maximum(np.diagonal(damping), 0.0))
    stiffness = stiffness if np.linalg.eigvalsh(stiffness)[0] >= 0 else np.zeros((m, m))
    largest_entries = [float(np.abs(np.diagonal(matrix)).max()) for matrix in (mass, damping, stiffness)]
    tolerance = Tolerance(
        RIGID_MASS_SHARE * largest_entries[0],
        RIGID_SHARE * largest_entries[1] or None,
        RIGID_SHARE * largest_entries[2] or None,
        None,
    )
    return replace(model, mass=mass, damping=damping, stiffness=stiffness, tolerance=tolerance)


def _compute_least_mass(accelerations: FloatArray, forces: FloatArray) -> FloatArray:
    """Compute lower bounds (m,) of the diagonal masses: the inertial force of each body is at least `MASSLESS_SHARE` of
    the force (standard deviations), because a simulation needs positive masses. accelerations, forces: (samples, m).
    A body without acceleration gets a huge finite bound (the divisor is at least 1e-300)."""
    return np.asarray(MASSLESS_SHARE * forces.std(axis=0) / np.maximum(accelerations.std(axis=0), 1e-300))


def _solve_least_squares(regressors: FloatArray, target: FloatArray) -> tuple[FloatArray, float]:
    """Solve for the coefficients (k, m), and compute the mean square of the residual. regressors: (samples, k), scaled
    to unit column norms for the solution; target: (samples, m)."""
    column_norms = np.maximum(np.linalg.norm(regressors, axis=0), np.finfo(float).tiny)
    coefficients = np.linalg.lstsq(regressors / column_norms, target, rcond=None)[0] / column_norms[:, None]
    return np.asarray(coefficients), float(np.mean((target - regressors @ coefficients) ** 2))
