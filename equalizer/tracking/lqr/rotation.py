"""Forces for every rotation of a trajectory by linear combination of a few stored solutions.

The forces are linear in the trajectory r, and R r = sum over i, j of R_ij (e_i r_j), with the unit vectors e_i. The
solutions for the trajectories e_i r_j, component j of r played along axis i, are stored: nine on three axes. Their sum
with the weights R_ij is the solution for the rotation R. A recording along a single direction needs only three. All
start from rest, because the free response of an initial motion does not rotate. Called by `contact` (normals) and
`changing_direction`, which is for a direction that changes during the playback.
"""

from dataclasses import dataclass

import numpy as np

from equalizer.signals.signal import FloatArray
from equalizer.tracking.lqr.lqr import StoredGains, track
from equalizer.tracking.lqr.tracking_problem import TrackingError, copy_read_only, require_trajectory


@dataclass(frozen=True, slots=True, eq=False)
class RotationBasis:
    """Stored solutions, made by `compute_rotation_basis` (a direction is a rotation, (p, p)) or `compute_normal_basis`
    (a normal, (p,)). Directions are not checked to be orthogonal or of unit length; other matrices and vectors also
    change the level."""

    stored_forces: FloatArray
    """(directions, N * m), N: forces of each solution, flattened."""
    stored_responses: FloatArray
    """(directions, N * p), m/s²: the model's response to them, flattened."""
    inputs: int
    """m, the number of forces."""
    direction_shape: tuple[int, ...]
    """(p, p) for rotations, (p,) for normals."""

    def compute_forces(self, direction: FloatArray) -> FloatArray:
        """Compute the forces (N, m), N, for a direction. Raises TrackingError for another shape of the direction."""
        return self._combine(self.stored_forces, direction, self.inputs)

    def predict_response(self, direction: FloatArray) -> FloatArray:
        """Predict the response (N, p), m/s², to the forces of a direction. Raises TrackingError for another shape."""
        return self._combine(self.stored_responses, direction, self.direction_shape[0])

    def _combine(self, stored_solutions: FloatArray, direction: FloatArray, column_count: int) -> FloatArray:
        """Add the stored solutions (directions, N * column_count), weighted by the elements of the direction; returns
        (N, column_count). Raises TrackingError for another shape of the direction."""
        weights = np.asarray(direction, dtype=np.float64)
        if weights.shape != self.direction_shape:
            raise TrackingError(f"a direction has shape {weights.shape}; this basis takes {self.direction_shape}")
        combined: FloatArray = np.dot(weights.reshape(-1), stored_solutions)
        return combined.reshape(-1, column_count)


def compute_rotation_basis(gains: StoredGains, trajectory: FloatArray) -> RotationBasis:
    """Compute the basis of p * p solutions for every rotation of a trajectory. trajectory: (N, p), m/s², before
    rotation; N as of the gains. Raises TrackingError for another shape."""
    p = gains.problem.outputs
    return _solve_basis(gains, make_axis_trajectories(require_trajectory(gains.problem, trajectory)), (p, p))


def compute_normal_basis(gains: StoredGains, recording: FloatArray) -> RotationBasis:
    """Compute the basis of p solutions for every normal. recording: (N,), m/s², to be played along a normal; N as of
    the gains. Raises TrackingError for another shape."""
    p = gains.problem.outputs
    return _solve_basis(gains, make_axis_recordings(recording, p), (p,))


def make_axis_trajectories(trajectory: FloatArray) -> FloatArray:
    """Make trajectories (p * p, N, p): entry i p + j is component j of the trajectory (N, p), along axis i."""
    p = trajectory.shape[1]
    return np.array([np.outer(samples, axis) for axis in np.eye(p) for samples in trajectory.T])


def make_axis_recordings(recording: FloatArray, outputs: int) -> FloatArray:
    """Make trajectories (p, N, p): entry i is the recording along axis i; outputs: p. Raises TrackingError for a
    recording that is not (N,)."""
    samples = np.asarray(recording, dtype=np.float64)
    if samples.ndim != 1 or not samples.size:
        raise TrackingError(f"a recording along one direction has shape {samples.shape}; it must be (N,), N >= 1")
    return np.array([np.outer(samples, axis) for axis in np.eye(outputs)])


def _solve_basis(gains: StoredGains, references: FloatArray, direction_shape: tuple[int, ...]) -> RotationBasis:
    """Make a basis from the solutions for trajectories (directions, N, p)."""
    solutions = [track(gains, reference) for reference in references]
    forces = np.array([solution.forces.ravel() for solution in solutions])
    responses = np.array([solution.predicted.ravel() for solution in solutions])
    return RotationBasis(copy_read_only(forces), copy_read_only(responses), gains.problem.inputs, direction_shape)
