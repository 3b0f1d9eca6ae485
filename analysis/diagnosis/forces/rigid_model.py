"""Fits a model with one body per command to a device in closed loop, by least squares on forces.

    f = M q'' + D q' + K q + f0        M, D, K made symmetric after the fit; K only where springs reduce the misfit

along the measured motion q, both sides low-pass filtered, as rigid robots are identified (Gautier, Vandanjon and Pressé
1994). Frequency responses from commands to motions would be biased by the controller. Called by `fit_without_model`,
where no model was given.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from analysis.diagnosis.data.closed_loop import is_in_closed_loop
from analysis.diagnosis.data.measured_motion import has_motion
from analysis.diagnosis.data.observed_parts import observe_parts
from analysis.diagnosis.forces.force_views import build_force_views
from analysis.diagnosis.forces.inverse_dynamics import compute_required_force
from analysis.diagnosis.forces.predicted_force import PredictedForce
from analysis.diagnosis.noise.noise_floor import estimate_noise_floor
from analysis.diagnosis.settings import MASSLESS_SHARE, RIGID_MASS_SHARE, RIGID_SHARE, SPRING_SHARE
from equalizer.plant.mechanical_model import DERIVATIVE_OF_QUANTITY, MechanicalModel, MechanicalModelError, Tolerance
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray

_FIT_COUNT = 2
"""Number of fits: the band in which forces are compared depends on the model, so the fit is repeated with the first."""


def should_use_rigid_model(recordings: Sequence[Recording]) -> bool:
    """Whether a rigid model is preferred: a controller made the commands, or a motion was imposed."""
    return can_be_rigid(recordings) and any(
        is_in_closed_loop(recording) or recording.meta.get("imposed") for recording in recordings
    )


def can_be_rigid(recordings: Sequence[Recording]) -> bool:
    """Whether one position or velocity was measured for every command, all of the same order of derivative."""
    return all(_is_square(recording) for recording in recordings)


def fit_rigid_model(recordings: Sequence[Recording], name: str) -> MechanicalModel:
    """Least-squares model with one body per command. Raises MechanicalModelError where the forces give no positive
    mass, or where no motion was measured."""
    model = _make_unit_mass_model(recordings[0], name)
    records = observe_parts(recordings, model.outputs)
    if not all(has_motion(record.recording, model) for record in records):
        raise MechanicalModelError(("neither positions nor velocities were measured",))
    floors = [estimate_noise_floor(record.recording) for record in records]
    for _ in range(_FIT_COUNT):
        model = _fit_to_forces(model, build_force_views(records, model, floors).measure)
    return model


def _is_square(recording: Recording) -> bool:
    """Whether there is one response per command, all responses are of one derivative of the position, and a position or
    velocity was measured for each."""
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
    """The model that the first band is computed with: unit masses without dampers and springs."""
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
    """The model with fitted matrices, made passive, and with their tolerances."""
    regressor_rows, targets = [], []
    for record, motion in zip(measure.records, measure.motions, strict=True):
        motion_and_force = compute_required_force(model, motion)
        is_used = record.fit | record.choose
        columns = (
            motion_and_force.axis_acceleration,
            motion_and_force.axis_velocity,
            motion_and_force.axis_position,
            np.ones((len(is_used), 1)),
        )
        regressor_rows.append(np.hstack(columns)[is_used])
        targets.append(record.measured[is_used])
    regressors, target, m = np.vstack(regressor_rows), np.vstack(targets), model.inputs
    full_fit, full_error = _solve_least_squares(regressors, target)
    springless_fit, springless_error = _solve_least_squares(np.delete(regressors, range(2 * m, 3 * m), axis=1), target)
    has_springs = full_error < (1 - SPRING_SHARE) * springless_error
    mass, damping = (
        (matrix + matrix.T) / 2 for matrix in (full_fit if has_springs else springless_fit)[: 2 * m].reshape(2, m, m)
    )
    mass = mass + np.diag(np.maximum(_compute_least_mass(regressors[:, :m], target) - np.diagonal(mass), 0.0))
    stiffness = (full_fit[2 * m : 3 * m] + full_fit[2 * m : 3 * m].T) / 2 if has_springs else np.zeros((m, m))
    # Negative damping or stiffness is set to zero: a linear model must be passive, and the diagnosis looks for the
    # cause.
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


def _compute_least_mass(acceleration: FloatArray, force: FloatArray) -> FloatArray:
    """(m,): least masses, for bodies whose inertia does not show in the force: a simulation needs a positive mass."""
    return np.asarray(MASSLESS_SHARE * force.std(axis=0) / np.maximum(acceleration.std(axis=0), 1e-300))


def _solve_least_squares(regressors: FloatArray, target: FloatArray) -> tuple[FloatArray, float]:
    """(k, m): coefficients; and the mean square of the residual."""
    column_norms = np.maximum(np.linalg.norm(regressors, axis=0), np.finfo(float).tiny)
    coefficients = np.linalg.lstsq(regressors / column_norms, target, rcond=None)[0] / column_norms[:, None]
    return np.asarray(coefficients), float(np.mean((target - regressors @ coefficients) ** 2))
