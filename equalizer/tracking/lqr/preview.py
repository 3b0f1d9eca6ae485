"""Linear-quadratic preview control: a trajectory that arrives while it is played, and the loss of a limited preview.

The gains are those of the infinite horizon (`stationary_gains`). Samples that are not known yet count as zero, the
expected value of a zero-mean signal. A device without acceleration response to a constant force needs a long preview; a
low-frequency weight (`TrackingWeights`) shortens it to about 0.2 s, at the cost of a larger loss at shorter previews
and a small loss at full preview: `preview_loss` computes both.
"""

from dataclasses import dataclass

import numpy as np

from equalizer.signals.signal import ComplexArray, FloatArray
from equalizer.tracking.lqr import lqr_kernel
from equalizer.tracking.lqr.lqr import TrackResult
from equalizer.tracking.lqr.riccati import stationary_gains
from equalizer.tracking.lqr.tracking_problem import TrackingError, TrackingProblem, read_only, require_trajectory

LINE_HZ = 0.1
"""Spacing of the spectral lines over which a loss is averaged."""


@dataclass(frozen=True, slots=True, eq=False)
class PreviewTracker:
    """Controller u_k = sum over j < M of ahead_j r_{k+j} - K x_k. Made by `preview_tracker`."""

    problem: TrackingProblem
    K: FloatArray
    """(m, n): stationary gains on the state of the simulated model."""
    preview_gains: FloatArray
    """(M, m, p): weights of the present sample and of the M - 1 samples after it."""

    def __len__(self) -> int:
        return int(self.preview_gains.shape[0])

    def step(self, x: FloatArray, previewed: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Force (m,), N, of this sample, and the next state. x: (n,), the state; previewed: (M, p), the present sample
        first."""
        force = np.einsum("jmp,jp->m", self.preview_gains, previewed) - self.K @ x
        return force, self.problem.A @ x + self.problem.B @ force


@dataclass(frozen=True, slots=True)
class PreviewLoss:
    """Relative rms error of the response over the model's band, as the model predicts it, for a stationary trajectory
    with equal flat spectra on all axes."""

    error: float
    """Error with the limited preview."""
    full_error: float
    """Error with unlimited preview."""


def preview_tracker(problem: TrackingProblem, preview_samples: int) -> PreviewTracker:
    """Tracker with M = preview_samples known samples, including the present sample. Raises TrackingError for less than
    1 sample, and where there are no stationary gains."""
    if preview_samples < 1:
        raise TrackingError(f"the preview is {preview_samples} samples; the present one at least must be known")
    gains = stationary_gains(problem)
    K, H_inverse = gains.K[0], gains.H_inverse[0]
    closed_loop, linear = _close_loop(problem, K)
    weights = np.empty((preview_samples, problem.inputs, problem.outputs))
    weights[0] = H_inverse @ problem.linear_cost[:, problem.order :].T
    for j in range(1, preview_samples):
        weights[j] = H_inverse @ problem.B.T @ linear
        linear = closed_loop.T @ linear
    return PreviewTracker(problem, K, read_only(weights))


def stream(tracker: PreviewTracker, reference: FloatArray, x0: FloatArray | None = None) -> TrackResult:
    """Track a trajectory (N, p), m/s², as a stream, followed by zeros; equal to `step` row by row, but compiled. x0:
    (n,), initial state; None = at rest."""
    problem, M = tracker.problem, len(tracker)
    r = require_trajectory(problem, reference)
    windows = np.lib.stride_tricks.sliding_window_view(np.pad(r, ((0, M - 1), (0, 0))), M, axis=0)
    g = np.ascontiguousarray(np.einsum("jmp,npj->nm", tracker.preview_gains, windows, optimize=True))
    K = np.repeat(tracker.K[np.newaxis], len(r), axis=0)
    x = problem.state(x0).copy()
    forces, predicted = np.empty_like(g), np.empty_like(r)
    lqr_kernel.simulate(problem.step, K, g, x, forces, predicted)
    return TrackResult(forces, predicted, x)


def preview_loss(problem: TrackingProblem, preview_samples: int) -> PreviewLoss:
    """Loss of a limited preview, from exact frequency responses over the model's band, without a simulation. Raises
    what `preview_tracker` raises."""
    tracker = preview_tracker(problem, preview_samples)
    low, high = problem.band_hz
    lines_hz = np.linspace(low, high, max(2, round((high - low) / LINE_HZ) + 1))
    z = np.exp(2j * np.pi * lines_hz / problem.sample_rate_hz)
    closed_response = _compute_closed_response(problem, tracker.K, z)
    response = np.einsum("lj,jmp->lmp", z[:, np.newaxis] ** np.arange(len(tracker)), tracker.preview_gains)
    return PreviewLoss(
        _relative_error(closed_response @ response), _relative_error(closed_response @ _full_preview(problem, z))
    )


def _close_loop(problem: TrackingProblem, K: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Closed loop A - B K, (n, n), and (C - D K)' Q for references of the tracked outputs, (n, p)."""
    n = problem.order
    return problem.A - problem.B @ K, (problem.linear_cost[:, :n] - problem.linear_cost[:, n:] @ K).T


def _compute_closed_response(problem: TrackingProblem, K: FloatArray, z: ComplexArray) -> ComplexArray:
    """(lines, p, m): response to forces that are added to -K x. z: (lines,), points of the unit circle."""
    n, p = problem.order, problem.outputs
    closed_loop = problem.A - problem.B @ K
    state = np.linalg.solve(
        z[:, np.newaxis, np.newaxis] * np.eye(n) - closed_loop, problem.B.astype(complex)[np.newaxis]
    )
    return np.asarray((problem.C[:p] - problem.D[:p] @ K) @ state + problem.D[:p])


def _full_preview(problem: TrackingProblem, z: ComplexArray) -> ComplexArray:
    """(lines, m, p): feedforward with unlimited preview; the sum over all future samples is a geometric series."""
    gains = stationary_gains(problem)
    closed_loop, linear = _close_loop(problem, gains.K[0])
    delay_factor = z[:, np.newaxis, np.newaxis]
    costate = delay_factor * np.linalg.solve(
        np.eye(problem.order) - delay_factor * closed_loop.T, linear.astype(complex)[np.newaxis]
    )
    present_gain = problem.linear_cost[:, problem.order :].T
    return np.asarray(gains.H_inverse[0] @ (present_gain + problem.B.T @ costate))


def _relative_error(delivered: ComplexArray) -> float:
    """Rms over lines and axes of delivered - I. delivered: (lines, p, p), from wanted to delivered acceleration."""
    p = delivered.shape[-1]
    return float(np.sqrt(np.mean(np.sum(np.abs(delivered - np.eye(p)) ** 2, axis=(1, 2))) / p))
