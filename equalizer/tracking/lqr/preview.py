"""Linear-quadratic preview control: a trajectory that arrives while it is played, and the loss of a limited preview.

The gains are those of the infinite horizon (`compute_stationary_gains`). Samples that are not known yet count as zero,
the expected value of a zero-mean signal. A device without acceleration response to a constant force needs a long
preview; a low-frequency weight (`TrackingWeights`) shortens it, at the cost of tracking error: `compute_preview_loss`
computes the loss.
"""

from dataclasses import dataclass

import numpy as np

from equalizer.signals.signal import ComplexArray, FloatArray
from equalizer.tracking.lqr import lqr_kernel
from equalizer.tracking.lqr.lqr import TrackResult
from equalizer.tracking.lqr.riccati import compute_stationary_gains
from equalizer.tracking.lqr.tracking_problem import TrackingError, TrackingProblem, copy_read_only, require_trajectory

LINE_SPACING_HZ = 0.1
"""Spacing of the spectral lines over which a loss is averaged. Chosen."""


@dataclass(frozen=True, slots=True, eq=False)
class PreviewTracker:
    """Controller u_k = sum over j < M of G_j r_{k+j} - K x_k, with the preview gains G. Made by
    `make_preview_tracker`."""

    problem: TrackingProblem
    K: FloatArray
    """(m, n): stationary gains on the state of the simulated model."""
    preview_gains: FloatArray
    """G, (M, m, p): weights of the present sample and of the M - 1 samples after it."""

    def __len__(self) -> int:
        return int(self.preview_gains.shape[0])

    def step(self, x: FloatArray, previewed_reference: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Compute the force (m,), N, of this sample, and the state (n,) at the next. x: (n,), the present state;
        previewed_reference: (M, p), m/s², the present sample first."""
        force = np.einsum("jmp,jp->m", self.preview_gains, previewed_reference) - self.K @ x
        return force, self.problem.A @ x + self.problem.B @ force


@dataclass(frozen=True, slots=True)
class PreviewLoss:
    """Relative rms error of the response over the model's band, as the model predicts it, for a stationary reference
    with equal flat spectra on all axes."""

    error: float
    """Error with the limited preview."""
    full_error: float
    """Error with unlimited preview."""


def make_preview_tracker(problem: TrackingProblem, preview_samples: int) -> PreviewTracker:
    """Make the tracker with M = preview_samples known samples, including the present sample. Raises TrackingError for
    less than 1 sample, and where there are no stationary gains."""
    if preview_samples < 1:
        raise TrackingError(f"the preview is {preview_samples} samples; the present one at least must be known")
    gains = compute_stationary_gains(problem)
    K, H_inverse = gains.K[0], gains.H_inverse[0]
    closed_loop, costate_factor = _close_loop(problem, K)
    preview_gains = np.empty((preview_samples, problem.inputs, problem.outputs))
    preview_gains[0] = H_inverse @ problem.linear_cost[:, problem.order :].T
    for j in range(1, preview_samples):
        preview_gains[j] = H_inverse @ problem.B.T @ costate_factor
        costate_factor = closed_loop.T @ costate_factor
    return PreviewTracker(problem, K, copy_read_only(preview_gains))


def track_stream(tracker: PreviewTracker, reference: FloatArray, x0: FloatArray | None = None) -> TrackResult:
    """Track a trajectory (N, p), m/s², as a stream, followed by zeros; equal to `PreviewTracker.step` row by row, but
    compiled. x0: (n,), initial state; None = at rest. Raises TrackingError for other shapes and values that are not
    finite."""
    problem, M = tracker.problem, len(tracker)
    r = require_trajectory(problem, reference)
    windows = np.lib.stride_tricks.sliding_window_view(np.pad(r, ((0, M - 1), (0, 0))), M, axis=0)
    g = np.ascontiguousarray(np.einsum("jmp,npj->nm", tracker.preview_gains, windows, optimize=True))
    K = np.repeat(tracker.K[np.newaxis], len(r), axis=0)
    x = problem.make_state(x0).copy()
    forces, predicted = np.empty_like(g), np.empty_like(r)
    lqr_kernel.simulate(problem.step, K, g, x, forces, predicted)
    return TrackResult(forces, predicted, x)


def compute_preview_loss(problem: TrackingProblem, preview_samples: int) -> PreviewLoss:
    """Compute the loss of a limited preview, from exact frequency responses over the model's band, without a
    simulation. Raises what `make_preview_tracker` raises."""
    tracker = make_preview_tracker(problem, preview_samples)
    low_hz, high_hz = problem.band_hz
    lines_hz = np.linspace(low_hz, high_hz, max(2, round((high_hz - low_hz) / LINE_SPACING_HZ) + 1))
    z = np.exp(2j * np.pi * lines_hz / problem.sample_rate_hz)
    closed_response = _compute_closed_response(problem, tracker.K, z)
    preview_response = np.einsum("lj,jmp->lmp", z[:, np.newaxis] ** np.arange(len(tracker)), tracker.preview_gains)
    return PreviewLoss(
        _compute_relative_error(closed_response @ preview_response),
        _compute_relative_error(closed_response @ _compute_full_preview(problem, z)),
    )


def _close_loop(problem: TrackingProblem, K: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Compute the closed loop A - B K, (n, n), and (C - D K)' Q of the tracked outputs, (n, p), the factor of the
    reference in the costate v."""
    n = problem.order
    return problem.A - problem.B @ K, (problem.linear_cost[:, :n] - problem.linear_cost[:, n:] @ K).T


def _compute_closed_response(problem: TrackingProblem, K: FloatArray, z: ComplexArray) -> ComplexArray:
    """Compute the response (lines, p, m) of the tracked outputs to forces that are added to -K x. z: (lines,), points
    of the unit circle."""
    n, p = problem.order, problem.outputs
    closed_loop = problem.A - problem.B @ K
    state = np.linalg.solve(
        z[:, np.newaxis, np.newaxis] * np.eye(n) - closed_loop, problem.B.astype(complex)[np.newaxis]
    )
    return np.asarray((problem.C[:p] - problem.D[:p] @ K) @ state + problem.D[:p])


def _compute_full_preview(problem: TrackingProblem, z: ComplexArray) -> ComplexArray:
    """Compute the frequency response (lines, m, p) of the feedforward with unlimited preview; the sum over all future
    samples is a geometric series. z: (lines,), points of the unit circle."""
    gains = compute_stationary_gains(problem)
    closed_loop, costate_factor = _close_loop(problem, gains.K[0])
    advance = z[:, np.newaxis, np.newaxis]
    costate = advance * np.linalg.solve(
        np.eye(problem.order) - advance * closed_loop.T, costate_factor.astype(complex)[np.newaxis]
    )
    present_gain = problem.linear_cost[:, problem.order :].T
    return np.asarray(gains.H_inverse[0] @ (present_gain + problem.B.T @ costate))


def _compute_relative_error(delivered: ComplexArray) -> float:
    """Compute the rms over lines and axes of delivered - I. delivered: (lines, p, p), response from reference to
    delivered acceleration."""
    p = delivered.shape[-1]
    return float(np.sqrt(np.mean(np.sum(np.abs(delivered - np.eye(p)) ** 2, axis=(1, 2))) / p))
