"""Inverse frequency response of a model: from the positions of its outputs to the forces along its axes.

For each frequency, with s = 2 pi i f, the force u and the coordinates q follow from the position y of the outputs by
one linear system,

    [M s² + D s + K   -B] [q]   [0]
    [C                 0] [u] = [y]

Solving it at each of many thousand lines is slow. The solution is a rational function of s whose poles are the model's
transmission zeros, generalised eigenvalues of the matrix pencil (Emami-Naeini and Van Dooren 1982, Automatica 18:415).
With the poles known, its partial fraction expansion is fitted to a few lines, and checked at others.

Sizes: n coordinates q, m inputs u and as many outputs y, k transmission zeros with non-negative imaginary part.
"""

from collections.abc import Callable

import numpy as np
import scipy.linalg

from equalizer.plant.linear_simulation import compute_driven_axes
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.signal import ComplexArray, FloatArray

MAX_SOLVED_LINES = 2000
"""Number of spectral lines up to which the system is solved at each line. Chosen by hand."""
RANGE_LINE_COUNT, POLE_LINE_OFFSETS = 60, np.array([-1.0, 0.0, 1.0])
"""Lines of the fit: number of logarithmically and of evenly spaced lines over the range, and distances of further lines
from each pole in units of its half-width. Chosen by hand."""
HIGHEST_POWER = 4
"""Highest power of s in the expansion: that of an inertia behind a massless coupling."""
POLE_LIMIT = 1e3
"""Ratio of a pole to the highest line above which a power of s represents it instead. Chosen by hand."""
FIT_TOLERANCE = 1e-8
"""Largest error at lines that were not fitted, relative to the line's largest entry of forces or of positions; above it
the system is solved at each line. Chosen, far below the noise of recordings."""


def compute_inverse_response(model: MechanicalModel, frequency_hz: FloatArray) -> ComplexArray:
    """Solve the system at each frequency, (lines,): (lines, 2 m, m), from the positions of the model's first m outputs
    to the forces along the driven axes, then to the axes' positions. Raises numpy.linalg.LinAlgError where these
    outputs do not determine the model's motion."""
    n, m = model.coordinates, model.inputs
    s = 2j * np.pi * frequency_hz[:, None, None]
    system = np.zeros((len(frequency_hz), n + m, n + m), dtype=np.complex128)
    system[:, :n, :n] = model.mass * s**2 + model.damping * s + model.stiffness
    system[:, :n, n:] = -model.input
    system[:, n:, :n] = model.output[:m]
    unit_outputs = np.concatenate([np.zeros((n, m)), np.eye(m)])
    solutions = np.linalg.solve(
        system, np.broadcast_to(unit_outputs.astype(np.complex128), (len(frequency_hz), n + m, m))
    )
    return np.concatenate([solutions[:, n:], compute_driven_axes(model).T @ solutions[:, :n]], axis=1)


def make_fast_inverse_response(
    model: MechanicalModel, line_count: int, highest_hz: float
) -> Callable[[FloatArray], ComplexArray]:
    """Return `compute_inverse_response` of this model as a function of frequency (Hz): the partial fraction expansion
    above `MAX_SOLVED_LINES` lines where its error is within `FIT_TOLERANCE`, else the exact solution. line_count: of
    the spectrum; highest_hz: the highest of its lines. Raises as `compute_inverse_response`, at once or when the
    function is called."""
    if line_count > MAX_SOLVED_LINES and (expansion := _fit_partial_fractions(model, highest_hz)) is not None:
        return expansion
    return lambda frequency_hz: compute_inverse_response(model, frequency_hz)


def _fit_partial_fractions(model: MechanicalModel, highest_hz: float) -> Callable[[FloatArray], ComplexArray] | None:
    """Fit a partial fraction expansion of the inverse to a few lines; None where its error between them exceeds
    `FIT_TOLERANCE`."""
    poles = compute_transmission_zeros(model, 2 * np.pi * POLE_LIMIT * highest_hz)
    lines_hz, angular_unit, m = _choose_lines(poles, highest_hz), 2 * np.pi * highest_hz, model.inputs
    exact_response, basis = compute_inverse_response(model, lines_hz), _evaluate_basis(lines_hz, poles, angular_unit)
    # Forces and positions are fitted separately, and each line is scaled: entries differ by many orders of magnitude.
    force_coefficients, position_coefficients = (
        _fit_coefficients(basis, entries.reshape(len(lines_hz), -1))
        for entries in (exact_response[:, :m], exact_response[:, m:])
    )
    if force_coefficients is None or position_coefficients is None:
        return None
    coefficients = np.hstack([force_coefficients, position_coefficients])

    def evaluate(frequency_hz: FloatArray) -> ComplexArray:
        """Evaluate the expansion, (lines, 2 m, m); below the lowest fitted line, solve the system."""
        response: ComplexArray = (_evaluate_basis(frequency_hz, poles, angular_unit) @ coefficients).reshape(
            -1, 2 * m, m
        )
        is_below_lines = frequency_hz < lines_hz[0]
        if is_below_lines.any():
            response[is_below_lines] = compute_inverse_response(model, frequency_hz[is_below_lines])
        return response

    return evaluate


def _fit_coefficients(basis: ComplexArray, exact_response: ComplexArray) -> ComplexArray | None:
    """Fit the coefficients, (functions, entries), by least squares to every other line; None where the error at the
    lines between exceeds `FIT_TOLERANCE`. basis: (lines, functions); exact_response: (lines, entries)."""
    line_magnitude = np.abs(exact_response).max(axis=1)[:, None]
    basis, exact_response = basis / line_magnitude, exact_response / line_magnitude
    # Columns scaled to equal norm, so that units do not matter; singular values at rounding errors (1e-14) are dropped.
    column_norms = np.linalg.norm(basis[::2], axis=0)
    coefficients = (
        np.linalg.lstsq(basis[::2] / column_norms, exact_response[::2], rcond=1e-14)[0] / column_norms[:, None]
    )
    return coefficients if np.all(np.abs(basis[1::2] @ coefficients - exact_response[1::2]) <= FIT_TOLERANCE) else None


def compute_transmission_zeros(model: MechanicalModel, largest_magnitude: float) -> ComplexArray:
    """Compute the transmission zeros (k,), rad/s, from the first m outputs: those with non-negative imaginary part and
    a magnitude below `largest_magnitude` (rad/s)."""
    n, m = model.coordinates, model.inputs
    system_matrix, mass_matrix = np.zeros((2 * n + m, 2 * n + m)), np.zeros((2 * n + m, 2 * n + m))
    system_matrix[:n, n : 2 * n] = np.eye(n)
    system_matrix[n : 2 * n, :n], system_matrix[n : 2 * n, n : 2 * n] = -model.stiffness, -model.damping
    system_matrix[n : 2 * n, 2 * n :], system_matrix[2 * n :, :n] = model.input, model.output[:m]
    mass_matrix[:n, :n], mass_matrix[n : 2 * n, n : 2 * n] = np.eye(n), model.mass
    numerators, denominators = scipy.linalg.eigvals(system_matrix, mass_matrix, homogeneous_eigvals=True)
    is_within_limit = np.abs(numerators) < largest_magnitude * np.abs(denominators)
    zeros = numerators[is_within_limit] / denominators[is_within_limit]
    return np.asarray(zeros[zeros.imag >= 0])


def _choose_lines(poles: ComplexArray, highest_hz: float) -> FloatArray:
    """Choose the lines (Hz), rising: over the range up to highest_hz, and about each pole. poles: (k,), rad/s;
    the half-width of a nearly undamped pole is set to 1e-6 of its magnitude, so that lines do not coincide."""
    half_widths = np.maximum(np.abs(poles.real), 1e-6 * np.abs(poles))
    pole_lines_hz = (np.abs(poles.imag)[:, None] + half_widths[:, None] * POLE_LINE_OFFSETS).ravel() / (2 * np.pi)
    # Every other line tests the fit: near a pole, a second line 1 % higher. Distances are chosen by hand.
    log_spaced_hz = np.geomspace(1e-4 * highest_hz, highest_hz, RANGE_LINE_COUNT)
    evenly_spaced_hz = np.linspace(0.0, highest_hz, RANGE_LINE_COUNT)
    return np.unique(
        np.clip(
            np.concatenate([pole_lines_hz, 1.01 * pole_lines_hz, log_spaced_hz, evenly_spaced_hz]),
            1e-6 * highest_hz,
            highest_hz,
        )
    )


def _evaluate_basis(frequency_hz: FloatArray, poles: ComplexArray, angular_unit: float) -> ComplexArray:
    """Evaluate the basis functions, (lines, functions): powers of s, and 1 / (s - pole) for each pole and each complex
    conjugate. s and poles in units of angular_unit (rad/s), so that powers stay of order 1."""
    s = 2j * np.pi * frequency_hz[:, None] / angular_unit
    powers = s ** np.arange(HIGHEST_POWER + 1)
    resonances = [1 / (s - poles / angular_unit), 1 / (s - np.conj(poles[poles.imag > 0]) / angular_unit)]
    return np.asarray(np.concatenate([powers, *resonances], axis=1))
