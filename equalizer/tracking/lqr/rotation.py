"""Forces for every rotation of a trajectory by linear combination of a few stored solutions.

The forces are linear in the trajectory, and R r = sum over i, j of R_ij (e_i r_j). So the nine solutions for what axis
j wants, wanted along axis i, give each rotation as their combination; a recording along one direction needs only three.
All start from rest: an initial motion would add its free response, which does not rotate.
"""

from dataclasses import dataclass

import numpy as np

from equalizer.signals.signal import FloatArray
from equalizer.tracking.lqr.lqr import StoredGains, track
from equalizer.tracking.lqr.tracking_problem import TrackingError, read_only, require_trajectory


@dataclass(frozen=True, slots=True, eq=False)
class RotationBasis:
    """Made by `rotation_basis` or `normal_basis`. A direction is a rotation, (p, p), or a normal, (p,): the shape with
    which it was made. Any such matrix or vector is taken; one of another length also changes the level."""

    stored_forces: FloatArray
    """(directions, N * m)"""
    stored_answers: FloatArray
    """(directions, N * p)"""
    inputs: int
    direction_shape: tuple[int, ...]

    def forces(self, direction: FloatArray) -> FloatArray:
        """(N, m). Raises TrackingError on another shape of the direction."""
        return self._combine(self.stored_forces, direction, self.inputs)

    def predict_response(self, direction: FloatArray) -> FloatArray:
        """(N, p): the model's response to these forces."""
        return self._combine(self.stored_answers, direction, self.direction_shape[0])

    def _combine(self, stored: FloatArray, direction: FloatArray, columns: int) -> FloatArray:
        turned = np.asarray(direction, dtype=np.float64)
        if turned.shape != self.direction_shape:
            raise TrackingError(f"a direction has shape {turned.shape}; this basis takes {self.direction_shape}")
        combined: FloatArray = np.dot(turned.reshape(-1), stored)
        return combined.reshape(-1, columns)


def rotation_basis(gains: StoredGains, trajectory: FloatArray) -> RotationBasis:
    """Solutions from which those of every rotation of a trajectory are combined. trajectory: (N, p), before it is
    rotated. p * p solutions."""
    p = gains.problem.outputs
    return _solve_basis(gains, every_rotation(require_trajectory(gains.problem, trajectory)), (p, p))


def normal_basis(gains: StoredGains, recording: FloatArray) -> RotationBasis:
    """Solutions from which those of every normal are combined. recording: (N,), to be played along a normal. p
    solutions."""
    p = gains.problem.outputs
    return _solve_basis(gains, every_normal(recording, p), (p,))


def every_rotation(trajectory: FloatArray) -> FloatArray:
    """(p * p, N, p): row i p + j contains component j of the trajectory, along axis i."""
    p = trajectory.shape[1]
    return np.array([np.outer(samples, axis) for axis in np.eye(p) for samples in trajectory.T])


def every_normal(recording: FloatArray, outputs: int) -> FloatArray:
    """(p, N, p): row i contains the recording along axis i. Raises TrackingError on a recording that is not (N,)."""
    samples = np.asarray(recording, dtype=np.float64)
    if samples.ndim != 1 or not samples.size:
        raise TrackingError(f"a recording along one direction has shape {samples.shape}; it must be (N,), N >= 1")
    return np.array([np.outer(samples, axis) for axis in np.eye(outputs)])


def _solve_basis(gains: StoredGains, wanted: FloatArray, direction_shape: tuple[int, ...]) -> RotationBasis:
    solutions = [track(gains, each) for each in wanted]
    forces = np.array([solution.forces.ravel() for solution in solutions])
    answers = np.array([solution.predicted.ravel() for solution in solutions])
    return RotationBasis(read_only(forces), read_only(answers), gains.problem.inputs, direction_shape)
