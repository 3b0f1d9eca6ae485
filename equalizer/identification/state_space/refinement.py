"""Maximum-likelihood fit of a state-space model to frequency lines with known noise, by Levenberg-Marquardt.

Theory of operation. With known noise of each entry of the response, maximum likelihood is weighted least squares,

    J = sum over lines, outputs, inputs of |(G(z) - Y) / sd|²,        G(z) = C (z I - A)⁻¹ B + D

Y is the measured response and sd the standard error of its entry. B and D enter linearly. At given poles and C they
follow by linear least squares (variable projection, Golub and Pereyra 1973), so that the search is over poles and C
alone; the Jacobian of the projected residual r is the partial derivative at fixed B and D, projected onto the
orthogonal complement of their span (Kaufman 1975). A step solves (J'J + damping diag(J'J)) step = -J'r. The damping
follows the ratio of the decrease of the cost to that which the linear model predicts (Nielsen 1999): a step that lowers
the cost multiplies it by 1/3 (good prediction) to 2 (poor); rejected steps multiply it by 2, 4, 8, ... Poles that a
step moves out of the allowed radius are moved back inside, so that the model is always stable.

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
"""Singular value of the scaled regressors, relative to the largest, below which the component of B and D is set to
zero, as it would be determined by rounding errors. Chosen."""


def solve_input_matrices(form: ModalForm, lines: WeightedLines) -> tuple[FloatArray, FloatArray]:
    """Solve for B (n, m) and D (p, m) by weighted linear least squares, for each input separately."""
    n, p = form.C.shape[1], form.C.shape[0]
    regressors = weight_regressors(form, lines)
    measured = stack_by_input(lines.weight * lines.response)
    solution = np.stack([_solve_least_squares(phi, y) for phi, y in zip(regressors, measured, strict=True)], axis=1)
    return solution[:n], solution[n : n + p]


def weight_regressors(form: ModalForm, lines: WeightedLines) -> FloatArray:
    """Build the weighted regressors of B and D, (m, 2 lines p, n + p): real parts, then imaginary parts."""
    states = form.compute_state_outputs(lines.z)
    p = form.C.shape[0]
    identity = np.broadcast_to(np.eye(p), (len(lines), p, p))
    phi = np.concatenate([states, identity], axis=2)
    weighted_regressors = lines.weight.transpose(2, 0, 1)[:, :, :, None] * phi
    flat_regressors = weighted_regressors.reshape(len(weighted_regressors), -1, phi.shape[2])
    return np.concatenate([flat_regressors.real, flat_regressors.imag], axis=1)


def stack_by_input(values: ComplexArray) -> FloatArray:
    """Stack complex values (lines, p, m) as real (m, 2 lines p), in the order of the rows of `weight_regressors`."""
    flat = values.transpose(2, 0, 1).reshape(values.shape[2], -1)
    return np.concatenate([flat.real, flat.imag], axis=1)


def _solve_least_squares(phi: FloatArray, y: FloatArray) -> FloatArray:
    """Solve phi w = y by least squares with columns scaled to unit norm, truncated at `RANK_TOLERANCE`. phi: (rows,
    n + p); y: (rows,)."""
    column_norms = np.linalg.norm(phi, axis=0)
    column_norms[column_norms == 0] = 1.0
    solution: FloatArray = np.linalg.lstsq(phi / column_norms, y, rcond=RANK_TOLERANCE)[0] / column_norms
    return solution


FIRST_DAMPING, LEAST_DAMPING, LARGEST_DAMPING = 1e-3, 1e-14, 1e12
"""Damping of the first step, least damping, and the damping above which the search ends, because no step lowers the
cost; relative to the diagonal of J'J. Chosen; the least is above the rounding errors of J'J, which alone is singular:
the scale of a state is free in C, because B absorbs it."""

LEAST_COST_DECREASE = 1e-7
"""Relative decrease of the cost in a step below which the search ends. Chosen."""

UNOBSERVABLE_DIAGONAL = 1e-13
"""Magnitude of a diagonal entry of R, in the QR decomposition of the scaled regressors, below which a state counts as
unobservable: rounding errors of order-1 columns are about 1e-15. Chosen."""


@dataclass(frozen=True, slots=True, eq=False)
class FittedForm:
    """Poles and output matrix C (`form`) with the input matrices B and D."""

    form: ModalForm
    B: FloatArray
    """(n, m)"""
    D: FloatArray
    """(p, m)"""

    def compute_response(self, z: ComplexArray) -> ComplexArray:
        """Compute the response C (z I - A)⁻¹ B + D, (lines, p, m). z: (lines,)."""
        return np.asarray(self.form.compute_state_outputs(z) @ self.B + self.D, dtype=np.complex128)


@dataclass(frozen=True, slots=True, eq=False)
class _ProjectedFit:
    """Cost, residual and projection at given poles and C, with the B and D that minimise the cost."""

    form: ModalForm
    basis: FloatArray
    """(m, rows, n + p): for each input, orthonormal basis of the span of its regressors, which B and D can explain."""
    input_matrices: FloatArray
    """(m, n + p): columns of B, then of D, of each input."""
    residual: FloatArray
    """(m, rows): weighted modelled minus measured response; rows = 2 lines p."""
    cost: float
    """Sum of squares of the residual, J."""


def refine_form(form: ModalForm, lines: WeightedLines, radius: Radius, max_steps: int = 60) -> FittedForm:
    """Refine poles and C to a local minimum of the cost, with all poles within the radius (common, or (blocks,)). Ends
    after `max_steps` accepted steps (default chosen), a decrease below `LEAST_COST_DECREASE`, or a damping above
    `LARGEST_DAMPING`."""
    current_fit = _evaluate_form(form, lines)
    damping, damping_factor = FIRST_DAMPING, 2.0
    for _ in range(max_steps):
        jacobian = _compute_jacobian(current_fit, lines)
        normal_matrix = np.einsum("jra,jrb->ab", jacobian, jacobian, optimize=True)
        gradient = np.einsum("jra,jr->a", jacobian, current_fit.residual, optimize=True)
        while True:
            step = _compute_step(normal_matrix, gradient, damping)
            trial_fit = _evaluate_form(_apply_step(current_fit.form, step, radius), lines)
            if trial_fit.cost < current_fit.cost or damping > LARGEST_DAMPING:
                break
            damping, damping_factor = damping * damping_factor, damping_factor * 2
        decrease = current_fit.cost - trial_fit.cost
        if not decrease > 0:
            break
        expected_decrease = -float(step @ (2 * gradient + normal_matrix @ step))
        damping *= (
            max(1 / 3, 1 - (2 * min(decrease / expected_decrease, 1.5) - 1) ** 3) if expected_decrease > 0 else 1.0
        )
        damping = max(damping, LEAST_DAMPING)
        damping_factor = 2.0
        is_converged = decrease < LEAST_COST_DECREASE * current_fit.cost
        current_fit = trial_fit
        if is_converged:
            break
    n = form.C.shape[1]
    return FittedForm(current_fit.form, current_fit.input_matrices[:, :n].T, current_fit.input_matrices[:, n:].T)


def complete_form(form: ModalForm, lines: WeightedLines) -> FittedForm:
    """Complete a form with its least-squares B and D; poles and C are not changed."""
    return FittedForm(form, *solve_input_matrices(form, lines))


def _compute_step(normal_matrix: FloatArray, gradient: FloatArray, damping: float) -> FloatArray:
    """Compute the step (parameters,) from J'J and J'r, in parameters that are scaled to a unit diagonal; 1e-300 avoids
    a division by zero for a parameter without effect."""
    diagonal = np.diag(normal_matrix) + 1e-300
    diagonal_roots = np.sqrt(diagonal)
    scaled_matrix = normal_matrix / diagonal_roots[:, None] / diagonal_roots
    scaled_matrix[np.diag_indices_from(scaled_matrix)] += damping
    return np.asarray(-np.linalg.solve(scaled_matrix, gradient / diagonal_roots) / diagonal_roots, dtype=np.float64)


def _apply_step(form: ModalForm, step: FloatArray, radius: Radius) -> ModalForm:
    """Apply a step (a, b, C row by row) to a form, and move poles outside the radius back inside."""
    block_count = len(form.a)
    a, b = stabilise_blocks(form.a + step[:block_count], form.b + step[block_count : 2 * block_count], radius)
    return ModalForm(a, b, form.C + step[2 * block_count :].reshape(form.C.shape))


def _evaluate_form(form: ModalForm, lines: WeightedLines) -> _ProjectedFit:
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
    return _ProjectedFit(form, basis, solution, residual, float((residual**2).sum()))


def _compute_jacobian(fit: _ProjectedFit, lines: WeightedLines) -> FloatArray:
    """Compute the partial derivatives (m, rows, parameters) of the residual with respect to a, then b, then C row by
    row, with the span of B and D projected out (Kaufman)."""
    form, z = fit.form, lines.z
    p, n = form.C.shape
    block_count = n // 2
    B = fit.input_matrices[:, :n].T
    state_outputs, state_responses = form.compute_state_outputs(z), form.compute_state_responses(z, B)
    m = B.shape[1]
    derivatives = np.zeros((m, len(z), p, 2 * block_count + p * n), dtype=np.complex128)
    products = np.einsum("lis,lsj->jlis", state_outputs, state_responses)
    derivatives[..., :block_count] = products[..., ::2] + products[..., 1::2]
    derivatives[..., block_count : 2 * block_count] = np.einsum(
        "lis,lsj->jlis", state_outputs[:, :, 1::2], state_responses[:, ::2]
    )
    # With a single output, B absorbs every change of C: no step of C, whose derivative would be rounding errors.
    for i in range(p) if p > 1 else ():
        derivatives[:, :, i, 2 * block_count + i * n : 2 * block_count + (i + 1) * n] = state_responses.transpose(
            2, 0, 1
        )
    derivatives *= lines.weight.transpose(2, 0, 1)[..., None]
    flat_derivatives = derivatives.reshape(m, -1, derivatives.shape[-1])
    real_derivatives = np.concatenate([flat_derivatives.real, flat_derivatives.imag], axis=1)
    return np.asarray(
        real_derivatives - fit.basis @ (fit.basis.transpose(0, 2, 1) @ real_derivatives), dtype=np.float64
    )
