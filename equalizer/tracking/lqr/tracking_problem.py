"""Quadratic cost of finite-horizon LQR tracking: a model, and the weights of tracking errors and forces.

    sum over k of (y_k - r_k)' Q (y_k - r_k) + u_k' R u_k,    x_{k+1} = A x_k + B u_k,  y_k = C x_k + D u_k

A device without acceleration response to a constant force has zeros near z = 1: the forces of its model's exact inverse
drift at low frequencies, below the identified band. The force weight R penalises forces at all frequencies, the
low-frequency weight only there: it penalises w, a first-order low pass of each force, w_{k+1} = a w_k + (1 - a) u_k, as
a further output with zero reference (frequency-dependent weights by augmenting the plant: Anderson and Moore, Optimal
Control: Linear Quadratic Methods, 1990, chapter 9). Begin at `make_tracking_problem`, whose result `lqr` solves.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import block_diag

from equalizer.plant.identified_model import IdentifiedModel
from equalizer.signals.signal import FloatArray


class TrackingError(ValueError):
    """A tracking problem has no valid solution, or its arguments are invalid."""


@dataclass(frozen=True, slots=True, eq=False)
class TrackingWeights:
    """Weights of the cost; their defaults are chosen. Raises TrackingError for weights that are negative or not finite,
    a corner that is not positive and finite, and an output weight that is not symmetric and positive semidefinite."""

    weight: float = 1e-3
    """Weight of |u|²: R = weight I, (m/s² per N)². The delivered acceleration is too low by the relative amount
    weight / |G|², approximately, where G is the frequency response (m/s² per N)."""
    output_weight: FloatArray | None = None
    """Q, (p, p), symmetric, no negative eigenvalue; None = identity."""
    low_frequency_weight: float = 0.0
    """Weight of |w|², (m/s² per N)²; 0 = none. A larger one shortens the preview that the inverse needs."""
    low_frequency_hz: float = 3.0
    """Corner frequency (Hz) of the low pass from u to w."""

    def __post_init__(self) -> None:
        for name in ("weight", "low_frequency_weight"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value >= 0):
                raise TrackingError(f"{name} is {value}; it must be a number that is not negative")
        if not (np.isfinite(self.low_frequency_hz) and self.low_frequency_hz > 0):
            raise TrackingError(f"low_frequency_hz is {self.low_frequency_hz}; it must be a positive number")
        if self.output_weight is not None:
            object.__setattr__(self, "output_weight", require_weight("output_weight", self.output_weight))


@dataclass(frozen=True, eq=False)
class TrackingProblem:
    """Matrices of the model with its penalised outputs, and of the cost. `make_tracking_problem` makes it of a model;
    the arrays are read-only. n: order, m: forces, p: tracked outputs, q: all outputs. Raises TrackingError for shapes
    that do not agree, values that are not finite, and a weight that is not symmetric and positive semidefinite."""

    A: FloatArray
    """(n, n)"""
    B: FloatArray
    """(n, m)"""
    C: FloatArray
    """(q, n): the p tracked outputs first, then those with zero reference."""
    D: FloatArray
    """(q, m)"""
    Q: FloatArray
    """(q, q)"""
    R: FloatArray
    """(m, m)"""
    outputs: int
    """p, the number of tracked outputs."""
    sample_rate_hz: float
    band_hz: tuple[float, float]
    """Band (Hz) in which the model is valid."""

    def __post_init__(self) -> None:
        for name in ("A", "B", "C", "D", "Q", "R"):
            object.__setattr__(self, name, copy_read_only(getattr(self, name)))
        self._require_consistent_matrices()
        require_weight("Q", self.Q)
        require_weight("R", self.R)

    def _require_consistent_matrices(self) -> None:
        """Raise TrackingError for values that are not finite, and shapes that do not agree."""
        matrices = {name: getattr(self, name) for name in ("A", "B", "C", "D", "Q", "R")}
        for name, matrix in matrices.items():
            if matrix.ndim != 2 or not np.isfinite(matrix).all():
                raise TrackingError(f"{name} must be a matrix of finite numbers")
        n, m, q = self.order, self.inputs, len(self.C)
        shapes = {"A": (n, n), "B": (n, m), "C": (q, n), "D": (q, m), "Q": (q, q), "R": (m, m)}
        for name, shape in shapes.items():
            if matrices[name].shape != shape:
                raise TrackingError(
                    f"{name} has shape {matrices[name].shape}, but {n} states, {m} forces and {q} outputs need {shape}"
                )
        if not 0 < self.outputs <= q:
            raise TrackingError(f"outputs is {self.outputs}; the tracked outputs are the first of the {q} rows of C")

    @property
    def order(self) -> int:
        """n, including the states of the low passes; the model's own states are the first."""
        return int(self.A.shape[0])

    @property
    def inputs(self) -> int:
        """Number of forces, m."""
        return int(self.B.shape[1])

    @cached_property
    def dynamics(self) -> FloatArray:
        """(n, n + m): [A B], so that x_{k+1} = [A B] [x_k; u_k]."""
        return copy_read_only(np.hstack((self.A, self.B)))

    @cached_property
    def step(self) -> FloatArray:
        """(n + m, n + p): [A B; C D]', so that [x_k, u_k] @ step = [x_{k+1}, y_k]."""
        p = self.outputs
        return copy_read_only(np.block([[self.A, self.B], [self.C[:p], self.D[:p]]]).T)

    @cached_property
    def stage_cost(self) -> FloatArray:
        """(n + m, n + m): quadratic cost of [x, u] with zero reference: [C D]' Q [C D], with R added to the forces'
        block."""
        n, outputs = self.order, np.hstack((self.C, self.D))
        cost = outputs.T @ self.Q @ outputs
        cost[n:, n:] += self.R
        return copy_read_only((cost + cost.T) / 2)

    @cached_property
    def linear_cost(self) -> FloatArray:
        """(p, n + m): rows of Q [C D] of the tracked outputs; -2 r' times it is the linear term of the cost in [x, u]
        for a reference sample r."""
        return copy_read_only((self.Q @ np.hstack((self.C, self.D)))[: self.outputs])

    def make_state(self, x0: FloatArray | None) -> FloatArray:
        """Complete an initial state to (n,); None = rest. x0: (n,), or the state of the model without the low passes,
        which then start at rest. Raises TrackingError for another length and for values that are not finite."""
        if x0 is None:
            return np.zeros(self.order)
        x = np.ascontiguousarray(x0, dtype=np.float64)
        if not np.isfinite(x).all():
            raise TrackingError("a state holds values that are not finite numbers")
        model_order = self.order - (self.C.shape[0] - self.outputs)
        if x.shape == (model_order,) != (self.order,):
            return np.concatenate((x, np.zeros(self.order - model_order)))
        if x.shape != (self.order,):
            raise TrackingError(f"a state has shape {x.shape}; this problem takes ({self.order},) or ({model_order},)")
        return x


def make_tracking_problem(model: IdentifiedModel, weights: TrackingWeights) -> TrackingProblem:
    """Make the problem of a model and its weights, with the low-passed forces as further outputs if these have a
    weight. Raises TrackingError for an output weight that is not (p, p)."""
    p, m = model.D.shape
    Q = np.eye(p) if weights.output_weight is None else weights.output_weight
    if Q.shape != (p, p):
        raise TrackingError(f"output_weight has shape {Q.shape}; {p} outputs need ({p}, {p})")
    A, B, C, D = model.A, model.B, model.C, model.D
    if weights.low_frequency_weight > 0:
        # A first-order low pass per force; its output is w_{k+1}, which includes the force of this sample.
        a = float(np.exp(-2 * np.pi * weights.low_frequency_hz / model.sample_rate_hz))
        identity = np.eye(m)
        A, B = block_diag(A, a * identity), np.vstack((B, (1 - a) * identity))
        C, D = block_diag(C, a * identity), np.vstack((D, (1 - a) * identity))
        Q = block_diag(Q, weights.low_frequency_weight * identity)
    R = weights.weight * np.eye(m)
    return TrackingProblem(A, B, C, D, Q, R, p, model.sample_rate_hz, model.band_hz)


def require_trajectory(problem: TrackingProblem, reference: FloatArray) -> FloatArray:
    """Return the reference trajectory (N, p) as a contiguous array. Raises TrackingError for another shape, no rows,
    and values that are not finite."""
    r = np.ascontiguousarray(reference, dtype=np.float64)
    if r.ndim != 2 or r.shape[1] != problem.outputs or not len(r):
        raise TrackingError(f"the trajectory has shape {r.shape}; this problem takes (N, {problem.outputs}), N >= 1")
    if not np.isfinite(r).all():
        raise TrackingError("the trajectory holds values that are not finite numbers; fill the gaps first")
    return r


def copy_read_only(values: FloatArray) -> FloatArray:
    """Return a contiguous, read-only copy as float64."""
    copy = np.array(values, dtype=np.float64, order="C")
    copy.flags.writeable = False
    return copy


def require_weight(name: str, weight: FloatArray) -> FloatArray:
    """Return a read-only copy of a weight. Raises TrackingError unless it is square, finite, symmetric (to within 1e-8)
    and positive semidefinite (to within 1e-12 of its largest entry). name: of the weight, for the message."""
    W = copy_read_only(weight)
    if W.ndim != 2 or W.shape[0] != W.shape[1] or not np.isfinite(W).all() or not np.allclose(W, W.T, rtol=1e-12):
        raise TrackingError(f"{name} must be a square symmetric matrix of finite numbers")
    lowest_eigenvalue = float(np.linalg.eigvalsh(W)[0]) if W.size else 0.0
    if lowest_eigenvalue < -1e-12 * float(np.abs(W).max(initial=0.0)):
        raise TrackingError(f"{name} has the eigenvalue {lowest_eigenvalue:g}; none may be negative")
    return W
