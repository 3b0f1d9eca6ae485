"""Maximum-likelihood fit of a model to lines with known noise, by Levenberg-Marquardt.

Theory of operation. With known noise of each entry of the response, maximum likelihood is weighted least squares,

    J = sum over lines, outputs, inputs of |(G(z) - Y) / sd|²,        G(z) = C (z I - A)⁻¹ B + D

Y is the measured response and sd the standard error of its entry. B and D enter linearly. At given poles and C they
follow by linear least squares (variable projection, Golub and Pereyra 1973), so that the search is over poles and C
alone; the Jacobian of the projected residual r is the partial derivative at fixed B and D, projected onto the
orthogonal complement of their span (Kaufman 1975). A step solves (J'J + damping diag(J'J)) step = -J'r. The damping
follows the ratio of the cost's fall to the fall that the linear model predicts (Nielsen 1999): a good step divides
it by up to 3; bad steps multiply it by 2, 4, 8, ... Poles that a step moves out of the allowed radius are moved
back inside, so that the model is always stable. Called by `candidates`, `relaxed_poles` and `bootstrap`.

References: Golub and Pereyra, SIAM J. Numer. Anal. 10 (1973), 413; Kaufman, BIT 15 (1975), 49; Nielsen, Damping
Parameter in Marquardt's Method, report IMM-REP-1999-05, Technical University of Denmark.
"""

from dataclasses import dataclass

import numpy as np

from equalizer.identification.state_space.modal_form import ModalForm
from equalizer.identification.state_space.stable_poles import Radius, stabilise_blocks
from equalizer.identification.state_space.weighted_lines import WeightedLines
from equalizer.signals.signal import ComplexArray, FloatArray

RANK_TOLERANCE = 1e-11
"""Singular value of the regressors, relative to the largest, below which the component of B and D is set to zero, as it
would be determined by noise."""


def solve_input_matrices(form: ModalForm, lines: WeightedLines) -> tuple[FloatArray, FloatArray]:
    """B (n, m) and D (p, m) by weighted linear least squares, for each input separately."""
    n, p = form.C.shape[1], form.C.shape[0]
    regressors = weight_regressors(form, lines)
    measured = stack_by_input(lines.weight * lines.response)
    solution = np.stack([_solve_least_squares(phi, y) for phi, y in zip(regressors, measured, strict=True)], axis=1)
    return solution[:n], solution[n : n + p]


def weight_regressors(form: ModalForm, lines: WeightedLines) -> FloatArray:
    """(m, 2 lines p, n + p): regressors of B and D for the weighted response, real parts, then imaginary ones."""
    states = form.compute_state_outputs(lines.z)
    p = form.C.shape[0]
    identity = np.broadcast_to(np.eye(p), (len(lines), p, p))
    phi = np.concatenate([states, identity], axis=2)
    weighted = lines.weight.transpose(2, 0, 1)[:, :, :, None] * phi
    flat = weighted.reshape(len(weighted), -1, phi.shape[2])
    return np.concatenate([flat.real, flat.imag], axis=1)


def stack_by_input(values: ComplexArray) -> FloatArray:
    """Stack complex values (lines, p, m) as real (m, 2 lines p), in the order of the rows of `weight_regressors`."""
    flat = values.transpose(2, 0, 1).reshape(values.shape[2], -1)
    return np.concatenate([flat.real, flat.imag], axis=1)


def _solve_least_squares(phi: FloatArray, y: FloatArray) -> FloatArray:
    """Least-squares solution with the columns scaled to unit norm, truncated at `RANK_TOLERANCE`."""
    column_norms = np.linalg.norm(phi, axis=0)
    column_norms[column_norms == 0] = 1.0
    solution: FloatArray = np.linalg.lstsq(phi / column_norms, y, rcond=RANK_TOLERANCE)[0] / column_norms
    return solution


FIRST_DAMPING, LARGEST_DAMPING = 1e-3, 1e12
"""Damping of the first step, and the damping above which the search ends, because no step lowers the cost; relative to
the diagonal of J'J."""

LEAST_COST_DECREASE = 1e-7
"""Relative fall of the cost in a step below which the search ends."""

UNOBSERVABLE_DIAGONAL = 1e-13
"""Magnitude of a diagonal entry of R, in the QR decomposition of the scaled regressors, below which a state counts as
unobservable."""


@dataclass(frozen=True, slots=True, eq=False)
class FittedForm:
    """A modal form with its B and D."""

    form: ModalForm
    B: FloatArray
    """(n, m)"""
    D: FloatArray
    """(p, m)"""

    def compute_response(self, z: ComplexArray) -> ComplexArray:
        """Response C (zI - A)^-1 B + D, (lines, p, m). z: (lines,)."""
        return np.asarray(self.form.compute_state_outputs(z) @ self.B + self.D, dtype=np.complex128)


@dataclass(frozen=True, slots=True, eq=False)
class _Point:
    """Cost, residuals and projection at given poles and outputs."""

    form: ModalForm
    basis: FloatArray
    """(m, rows, n + p): for each input, orthonormal basis of the span of its regressors, which B and D can explain."""
    input_matrices: FloatArray
    """(m, n + p): B and D of each input."""
    residual: FloatArray
    """(m, rows): model minus measured, weighted."""
    cost: float


def refine(form: ModalForm, lines: WeightedLines, radius: Radius, most_steps: int = 60) -> FittedForm:
    """Local optimum near a form by Levenberg-Marquardt, with all poles within the radius (common, or (blocks,))."""
    point = _evaluate_form(form, lines)
    damping, damping_factor = FIRST_DAMPING, 2.0
    for _ in range(most_steps):
        jacobian = _compute_jacobian(point, lines)
        normal = np.einsum("jra,jrb->ab", jacobian, jacobian, optimize=True)
        gradient = np.einsum("jra,jr->a", jacobian, point.residual, optimize=True)
        while True:
            step = _compute_step(normal, gradient, damping)
            trial = _evaluate_form(_apply_step(point.form, step, radius), lines)
            if trial.cost < point.cost or damping > LARGEST_DAMPING:
                break
            damping, damping_factor = damping * damping_factor, damping_factor * 2
        decrease = point.cost - trial.cost
        if not decrease > 0:
            break
        expected_decrease = -float(step @ (2 * gradient + normal @ step))
        damping *= (
            max(1 / 3, 1 - (2 * min(decrease / expected_decrease, 1.5) - 1) ** 3) if expected_decrease > 0 else 1.0
        )
        damping_factor = 2.0
        is_converged = decrease < LEAST_COST_DECREASE * point.cost
        point = trial
        if is_converged:
            break
    n = form.C.shape[1]
    return FittedForm(point.form, point.input_matrices[:, :n].T, point.input_matrices[:, n:].T)


def complete_form(form: ModalForm, lines: WeightedLines) -> FittedForm:
    """The form with its least-squares B and D; poles and C are not changed."""
    return FittedForm(form, *solve_input_matrices(form, lines))


def _compute_step(normal: FloatArray, gradient: FloatArray, damping: float) -> FloatArray:
    """Step from J'J and J'r, solved in parameters that are scaled to a unit diagonal."""
    scale = np.diag(normal) + 1e-300
    root = np.sqrt(scale)
    scaled = normal / root[:, None] / root
    scaled[np.diag_indices_from(scaled)] += damping
    return np.asarray(-np.linalg.solve(scaled, gradient / root) / root, dtype=np.float64)


def _apply_step(form: ModalForm, step: FloatArray, radius: Radius) -> ModalForm:
    """The form after a step (a, b, C row by row), with poles outside the radius moved back inside."""
    blocks = len(form.a)
    a, b = stabilise_blocks(form.a + step[:blocks], form.b + step[blocks : 2 * blocks], radius)
    return ModalForm(a, b, form.C + step[2 * blocks :].reshape(form.C.shape))


def _evaluate_form(form: ModalForm, lines: WeightedLines) -> _Point:
    """Solve for B and D at these poles and C by QR; the residual is the component outside the span of the
    regressors."""
    phi = weight_regressors(form, lines)
    column_norms = np.linalg.norm(phi, axis=1, keepdims=True)
    column_norms[column_norms == 0] = 1.0
    basis, triangle = np.linalg.qr(phi / column_norms)
    measured = stack_by_input(lines.weight * lines.response)
    projection = np.einsum("jrs,jr->js", basis, measured)
    residual = np.einsum("jrs,js->jr", basis, projection) - measured
    # For a state that is not observable (its column is zero, or a combination of others) R is singular.
    is_unobservable = np.abs(np.diagonal(triangle, axis1=1, axis2=2)) < UNOBSERVABLE_DIAGONAL
    triangle = triangle + np.eye(triangle.shape[1]) * np.where(is_unobservable, 1.0, 0.0)[:, None]
    solution = np.linalg.solve(triangle, projection[:, :, None])[:, :, 0] / column_norms[:, 0]
    return _Point(form, basis, solution, residual, float((residual**2).sum()))


def _compute_jacobian(point: _Point, lines: WeightedLines) -> FloatArray:
    """(m, rows, parameters): partial derivatives of the residual by a, then b, then C row by row, with the span of B
    and D projected out (Kaufman)."""
    form, z = point.form, lines.z
    p, n = form.C.shape
    blocks = n // 2
    B = point.input_matrices[:, :n].T
    state_outputs, state_responses = form.compute_state_outputs(z), form.compute_state_responses(z, B)
    m = B.shape[1]
    rows = np.zeros((m, len(z), p, 2 * blocks + p * n), dtype=np.complex128)
    products = np.einsum("lis,lsj->jlis", state_outputs, state_responses)
    rows[..., :blocks] = products[..., ::2] + products[..., 1::2]
    rows[..., blocks : 2 * blocks] = np.einsum("lis,lsj->jlis", state_outputs[:, :, 1::2], state_responses[:, ::2])
    for i in range(p):
        rows[:, :, i, 2 * blocks + i * n : 2 * blocks + (i + 1) * n] = state_responses.transpose(2, 0, 1)
    rows *= lines.weight.transpose(2, 0, 1)[..., None]
    flat = rows.reshape(m, -1, rows.shape[-1])
    real_rows = np.concatenate([flat.real, flat.imag], axis=1)
    return np.asarray(real_rows - point.basis @ (point.basis.transpose(0, 2, 1) @ real_rows), dtype=np.float64)
