"""Cost of a finite-horizon tracker: a model, and the weights of deviations and forces.

    sum over k of (y_k - r_k)' Q (y_k - r_k) + u_k' R u_k,    x_{k+1} = A x_k + B u_k,  y_k = C x_k + D u_k

A device that does not answer a constant force with acceleration has zeros near z = 1: the exact inverse of its model
drifts at low frequencies, where nothing was identified. The force weight limits that at all frequencies, the
low-frequency weight at low ones only: it penalises w of w_{k+1} = a w_k + (1 - a) u_k, a first-order low pass of each
force, as a further output with zero reference. (Weights by augmenting the plant: Anderson and Moore, Optimal Control:
Linear Quadratic Methods, 1990, chapter 9.)
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import block_diag

from equalizer.plant.identified_model import IdentifiedModel
from equalizer.signals.signal import FloatArray


class TrackingError(ValueError):
    """A tracking problem without a valid solution, or with inconsistent arguments."""


@dataclass(frozen=True, slots=True, eq=False)
class TrackingWeights:
    """Weights of the cost. Raises TrackingError for invalid ones."""

    weight: float = 1e-3
    """R = weight * I, of |u|². To be compared with |G|²: the level falls short by about weight / |G|²."""
    output_weight: FloatArray | None = None
    """Q, (p, p), symmetric, no negative eigenvalue; None = identity."""
    low_frequency_weight: float = 0.0
    """Weight of |low-passed u|². It shortens the preview that the inverse needs."""
    low_frequency_hz: float = 3.0
    """Corner frequency of that low pass."""

    def __post_init__(self) -> None:
        for name in ("weight", "low_frequency_weight"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value >= 0):
                raise TrackingError(f"{name} is {value}; it must be a number that is not negative")
        if not (np.isfinite(self.low_frequency_hz) and self.low_frequency_hz > 0):
            raise TrackingError(f"low_frequency_hz is {self.low_frequency_hz}; it must be a positive number")
        if self.output_weight is not None:
            object.__setattr__(self, "output_weight", _require_output_weight(self.output_weight))


@dataclass(frozen=True, eq=False)
class TrackingProblem:
    """Matrices of the model with its penalised outputs. Made by `make_tracking_problem`; arrays are read-only."""

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
    """p"""
    sample_rate_hz: float
    band_hz: tuple[float, float]

    def __post_init__(self) -> None:
        for name in ("A", "B", "C", "D", "Q", "R"):
            object.__setattr__(self, name, read_only(getattr(self, name)))

    @property
    def order(self) -> int:
        """n, the order including the states of the penalties; the model's own states come first."""
        return int(self.A.shape[0])

    @property
    def inputs(self) -> int:
        """Number of forces, m."""
        return int(self.B.shape[1])

    @cached_property
    def joined(self) -> FloatArray:
        """(n, n + m): [A B]"""
        return read_only(np.hstack((self.A, self.B)))

    @cached_property
    def step(self) -> FloatArray:
        """(n + m, n + p): [A B; C D]', so that [x, u] @ step = [x next, y]"""
        p = self.outputs
        return read_only(np.block([[self.A, self.B], [self.C[:p], self.D[:p]]]).T)

    @cached_property
    def stage_cost(self) -> FloatArray:
        """(n + m, n + m): quadratic cost of [x, u] with zero reference: [C D]' Q [C D], with R added to the forces'
        block."""
        n, outputs = self.order, np.hstack((self.C, self.D))
        cost = outputs.T @ self.Q @ outputs
        cost[n:, n:] += self.R
        return read_only((cost + cost.T) / 2)

    @cached_property
    def linear_cost(self) -> FloatArray:
        """(p, n + m): Q [C D], the linear term of the cost per reference sample."""
        return read_only((self.Q @ np.hstack((self.C, self.D)))[: self.outputs])

    def state(self, x0: FloatArray | None) -> FloatArray:
        """(n,): a given state with that of the penalties; at rest where None. Of the model's own state alone, (order of
        the model,), the penalties start at rest. Raises TrackingError on another length, and on values that are not
        finite."""
        if x0 is None:
            return np.zeros(self.order)
        x = np.ascontiguousarray(x0, dtype=np.float64)
        if not np.isfinite(x).all():
            raise TrackingError("a state holds values that are not finite numbers")
        own = self.order - (self.C.shape[0] - self.outputs)
        if x.shape == (own,) != (self.order,):
            return np.concatenate((x, np.zeros(self.order - own)))
        if x.shape != (self.order,):
            raise TrackingError(f"a state has shape {x.shape}; this problem takes ({self.order},) or ({own},)")
        return x


def make_tracking_problem(model: IdentifiedModel, weights: TrackingWeights) -> TrackingProblem:
    """Problem of a model and its weights, augmented by the low-passed forces as outputs where these are penalised.

    Raises TrackingError for an output weight of another size.
    """
    p, m = model.D.shape
    Q = np.eye(p) if weights.output_weight is None else weights.output_weight
    if Q.shape != (p, p):
        raise TrackingError(f"output_weight has shape {Q.shape}; {p} outputs need ({p}, {p})")
    A, B, C, D = model.A, model.B, model.C, model.D
    if weights.low_frequency_weight > 0:
        # One pole per force, w+ = a w + (1 - a) u, and its newest value as the output.
        a = float(np.exp(-2 * np.pi * weights.low_frequency_hz / model.sample_rate_hz))
        unit = np.eye(m)
        A, B = block_diag(A, a * unit), np.vstack((B, (1 - a) * unit))
        C, D = block_diag(C, a * unit), np.vstack((D, (1 - a) * unit))
        Q = block_diag(Q, weights.low_frequency_weight * unit)
    R = weights.weight * np.eye(m)
    return TrackingProblem(A, B, C, D, Q, R, p, model.sample_rate_hz, model.band_hz)


def require_trajectory(problem: TrackingProblem, wanted: FloatArray) -> FloatArray:
    """(N, p), contiguous. Raises TrackingError on another shape and on values that are not finite."""
    r = np.ascontiguousarray(wanted, dtype=np.float64)
    if r.ndim != 2 or r.shape[1] != problem.outputs or not len(r):
        raise TrackingError(f"the trajectory has shape {r.shape}; this problem takes (N, {problem.outputs}), N >= 1")
    if not np.isfinite(r).all():
        raise TrackingError("the trajectory holds values that are not finite numbers; fill the gaps first")
    return r


def read_only(values: FloatArray) -> FloatArray:
    """A contiguous copy that cannot be written."""
    copy = np.array(values, dtype=np.float64, order="C")
    copy.flags.writeable = False
    return copy


def _require_output_weight(Q: FloatArray) -> FloatArray:
    Q = read_only(Q)
    if Q.ndim != 2 or Q.shape[0] != Q.shape[1] or not np.isfinite(Q).all() or not np.allclose(Q, Q.T, rtol=1e-12):
        raise TrackingError("output_weight must be a square symmetric matrix of finite numbers")
    lowest = float(np.linalg.eigvalsh(Q)[0]) if Q.size else 0.0
    if lowest < -1e-12 * float(np.abs(Q).max(initial=0.0)):
        raise TrackingError(f"output_weight has the eigenvalue {lowest:g}; none may be negative")
    return Q
