"""Inverse frequency response of a model: from the positions of its outputs to the forces along its axes.

For each frequency, with s = 2 pi i f, the force u and the coordinates q follow from the position y of the outputs by
one linear system,

    [M s² + D s + K   -B] [q]   [0]
    [C                 0] [u] = [y]

Solving it at each of many thousand lines is slow. The solution is a rational function of s whose poles are the model's
transmission zeros, generalised eigenvalues of the matrix pencil (Emami-Naeini and Van Dooren 1982, Automatica 18:415).
With the poles known, its partial fraction expansion is fitted to a few lines, and checked at others.
"""

from collections.abc import Callable

import numpy as np
import scipy.linalg

from equalizer.plant.linear_simulation import compute_driven_axes
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.signal import ComplexArray, FloatArray

LINES_SOLVED_EACH = 2000
"""Number of spectral lines up to which the system is solved at each line."""
LINES_OVER_RANGE, HALF_WIDTHS = 60, np.array([-1.0, 0.0, 1.0])
"""Lines of the fit: number over the whole range, and distances from each pole in units of its half-width."""
HIGHEST_POWER = 4
"""Highest power of s in the expansion: that of an inertia behind a massless coupling."""
POLE_LIMIT = 1e3
"""Ratio of a pole to the highest line above which a power of s represents it instead."""
FIT_TOLERANCE = 1e-8
"""Largest relative error at lines that were not fitted; above it the system is solved at each line."""


def compute_inverse_response(model: MechanicalModel, frequency_hz: FloatArray) -> ComplexArray:
    """(lines, 2 m, m): from the positions of the model's first m outputs to the forces along the driven axes, and to
    the axes' positions. Raises numpy.linalg.LinAlgError where these outputs do not determine the model's motion."""
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
    """`compute_inverse_response` as a function of frequency (Hz), fast for many lines. line_count: number of lines;
    highest_hz: the highest of them."""
    if line_count > LINES_SOLVED_EACH and (expansion := _fit_partial_fractions(model, highest_hz)) is not None:
        return expansion
    return lambda frequency_hz: compute_inverse_response(model, frequency_hz)


def _fit_partial_fractions(model: MechanicalModel, highest_hz: float) -> Callable[[FloatArray], ComplexArray] | None:
    """The inverse as a partial fraction expansion fitted to a few lines; None where its error between them is too
    large."""
    poles = compute_transmission_zeros(model, 2 * np.pi * POLE_LIMIT * highest_hz)
    lines_hz, angular_unit, m = _choose_lines(poles, highest_hz), 2 * np.pi * highest_hz, model.inputs
    exact, basis = compute_inverse_response(model, lines_hz), _evaluate_basis(lines_hz, poles, angular_unit)
    # Forces and positions are fitted separately, and each line is scaled: entries differ by many orders of magnitude.
    forces, positions = (
        _fit_coefficients(basis, entries.reshape(len(lines_hz), -1)) for entries in (exact[:, :m], exact[:, m:])
    )
    if forces is None or positions is None:
        return None
    coefficients = np.hstack([forces, positions])

    def evaluate(frequency_hz: FloatArray) -> ComplexArray:
        """(lines, 2 m, m): the expansion; below the lowest fitted line, the exact solution."""
        response: ComplexArray = (_evaluate_basis(frequency_hz, poles, angular_unit) @ coefficients).reshape(
            -1, 2 * m, m
        )
        below_lines = frequency_hz < lines_hz[0]
        if below_lines.any():
            response[below_lines] = compute_inverse_response(model, frequency_hz[below_lines])
        return response

    return evaluate


def _fit_coefficients(basis: ComplexArray, exact: ComplexArray) -> ComplexArray | None:
    """(functions, entries): least-squares coefficients from every other line; None where the error at the others is too
    large."""
    line_magnitude = np.abs(exact).max(axis=1)[:, None]
    basis, exact = basis / line_magnitude, exact / line_magnitude
    # Columns scaled to equal norm, so that units do not matter.
    column_norms = np.linalg.norm(basis[::2], axis=0)
    coefficients = np.linalg.lstsq(basis[::2] / column_norms, exact[::2], rcond=1e-14)[0] / column_norms[:, None]
    return coefficients if np.all(np.abs(basis[1::2] @ coefficients - exact[1::2]) <= FIT_TOLERANCE) else None


def compute_transmission_zeros(model: MechanicalModel, largest_magnitude: float) -> ComplexArray:
    """(k,), rad/s: transmission zeros with non-negative imaginary part."""
    n, m = model.coordinates, model.inputs
    system_matrix, mass_matrix = np.zeros((2 * n + m, 2 * n + m)), np.zeros((2 * n + m, 2 * n + m))
    system_matrix[:n, n : 2 * n] = np.eye(n)
    system_matrix[n : 2 * n, :n], system_matrix[n : 2 * n, n : 2 * n] = -model.stiffness, -model.damping
    system_matrix[n : 2 * n, 2 * n :], system_matrix[2 * n :, :n] = model.input, model.output[:m]
    mass_matrix[:n, :n], mass_matrix[n : 2 * n, n : 2 * n] = np.eye(n), model.mass
    numerators, denominators = scipy.linalg.eigvals(system_matrix, mass_matrix, homogeneous_eigvals=True)
    within_limit = np.abs(numerators) < largest_magnitude * np.abs(denominators)
    zeros = numerators[within_limit] / denominators[within_limit]
    return np.asarray(zeros[zeros.imag >= 0])


def _choose_lines(poles: ComplexArray, highest_hz: float) -> FloatArray:
    """(lines,), Hz, rising: over the whole range and about each resonance."""
    half_width = np.maximum(np.abs(poles.real), 1e-6 * np.abs(poles))
    near_poles = (np.abs(poles.imag)[:, None] + half_width[:, None] * HALF_WIDTHS).ravel() / (2 * np.pi)
    # Halved steps: fitted and test lines alternate.
    log_spaced = np.geomspace(1e-4 * highest_hz, highest_hz, LINES_OVER_RANGE)
    evenly_spaced = np.linspace(0.0, highest_hz, LINES_OVER_RANGE)
    return np.unique(
        np.clip(
            np.concatenate([near_poles, 1.01 * near_poles, log_spaced, evenly_spaced]), 1e-6 * highest_hz, highest_hz
        )
    )


def _evaluate_basis(frequency_hz: FloatArray, poles: ComplexArray, angular_unit: float) -> ComplexArray:
    """(lines, functions): powers of s, and a resonance for each pole and its mirror image."""
    s = 2j * np.pi * frequency_hz[:, None] / angular_unit
    powers = s ** np.arange(HIGHEST_POWER + 1)
    resonances = [1 / (s - poles / angular_unit), 1 / (s - np.conj(poles[poles.imag > 0]) / angular_unit)]
    return np.asarray(np.concatenate([powers, *resonances], axis=1))
