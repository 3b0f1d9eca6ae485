"""Least-squares fit of a single mode to the frequency lines around a resonance peak, for many noise draws at once.

All entries of a response matrix share the pole pair; each has its own numerator, a parabola in s, which also represents
the modes outside the lines:  G(s) = (n0 + n1 s + n2 s²) / (s² + c1 s + c0),  with s = j f / f_m and f_m the
geometric mean of the first and the last line. Natural frequency f_m sqrt(c0), damping ratio c1 / (2 sqrt(c0)). Called
by `resonances`.
"""

import numpy as np

from equalizer.signals.signal import ComplexArray, FloatArray

_LINEAR_ITERATIONS, _NEWTON_ITERATIONS = 3, 8
"""Number of iteratively reweighted linear fits that give a starting value, and of Gauss-Newton steps from it.
Chosen."""


def fit_single_mode(
    frequency_hz: FloatArray, entries: ComplexArray, numerator_degree: int = 2
) -> tuple[FloatArray, FloatArray]:
    """Fit natural frequencies (draws,), Hz, and damping ratios (draws,); NaN where the fit is unstable or its natural
    frequency is not between the first and the last line. frequency_hz: (lines,), ascending, at least six. entries:
    (draws, lines, entries of the matrix). numerator_degree: 2 as in the module docstring, or another number of powers.

    Reweighted linear equations (Sanathanan and Koerner 1963) give starting values, whose damping is biased by noise;
    Gauss-Newton steps on the least-squares error remove that bias (variable projection, Kaufman 1975). Each step of c1
    and c0, of order 1 or less, is limited to 0.05 (chosen) against divergence.
    """
    centre_hz = float(np.sqrt(frequency_hz[0] * frequency_hz[-1]))
    s = np.asarray(1j * frequency_hz / centre_hz, dtype=np.complex128)
    powers_of_s = np.vander(s, numerator_degree + 1, increasing=True)
    c1, c0 = np.zeros(len(entries)), np.ones(len(entries))
    inverse_denominator: ComplexArray = np.ones((len(entries), len(s)), dtype=np.complex128)
    for _ in range(_LINEAR_ITERATIONS):
        basis = _compute_numerator_basis(powers_of_s, inverse_denominator)
        fixed_part, c1_part, c0_part = (
            _project_out(basis, entries * (power_of_s * inverse_denominator)[:, :, None])
            for power_of_s in (s**2, s, 1.0)
        )
        c1, c0 = _solve_two_unknowns(c1_part, c0_part, -fixed_part)
        inverse_denominator = _invert_denominator(s, c1, c0)
    for _ in range(_NEWTON_ITERATIONS):
        basis = _compute_numerator_basis(powers_of_s, inverse_denominator)
        residual = _project_out(basis, entries)
        scaled_model = (entries - residual) * inverse_denominator[:, :, None]
        step1, step0 = _solve_two_unknowns(
            _project_out(basis, scaled_model * s[:, None]), _project_out(basis, scaled_model), -residual
        )
        c1, c0 = c1 + np.clip(step1, -0.05, 0.05), c0 + np.clip(step0, -0.05, 0.05)
        inverse_denominator = _invert_denominator(s, c1, c0)
    root = np.sqrt(np.maximum(c0, np.finfo(np.float64).tiny))
    natural_hz, damping_ratio = centre_hz * root, c1 / (2 * root)
    is_valid = (c1 > 0) & (natural_hz > frequency_hz[0]) & (natural_hz < frequency_hz[-1])
    return np.where(is_valid, natural_hz, np.nan), np.where(is_valid, damping_ratio, np.nan)


def _invert_denominator(s: ComplexArray, c1: FloatArray, c0: FloatArray) -> ComplexArray:
    """Compute 1 / (s² + c1 s + c0), (draws, lines). s: (lines,); c1, c0: (draws,)."""
    inverse: ComplexArray = 1 / (s**2 + c1[:, None] * s + c0[:, None])
    return inverse


def _compute_numerator_basis(powers_of_s: ComplexArray, inverse_denominator: ComplexArray) -> ComplexArray:
    """Compute an orthonormal basis (draws, lines, powers) of the functions s^k / (s² + c1 s + c0)."""
    basis: ComplexArray = np.linalg.qr(powers_of_s * inverse_denominator[:, :, None])[0]
    return basis


def _project_out(basis: ComplexArray, values: ComplexArray) -> ComplexArray:
    """Project values (draws, lines, entries) onto the orthogonal complement of the basis."""
    residual: ComplexArray = values - basis @ (np.conj(basis.swapaxes(1, 2)) @ values)
    return residual


def _solve_two_unknowns(
    x_factors: ComplexArray, y_factors: ComplexArray, target: ComplexArray
) -> tuple[FloatArray, FloatArray]:
    """Solve x_factors x + y_factors y = target for real x and y, (draws,) each, in least squares, draw by draw. All
    arrays: (draws, lines, entries)."""

    def compute_inner_product(first_values: ComplexArray, second_values: ComplexArray) -> FloatArray:
        """Compute the real part of the inner product of each draw, (draws,)."""
        product: FloatArray = np.sum((np.conj(first_values) * second_values).real, axis=(1, 2))
        return product

    aa, ab, bb = (
        compute_inner_product(x_factors, x_factors),
        compute_inner_product(x_factors, y_factors),
        compute_inner_product(y_factors, y_factors),
    )
    ar, br = compute_inner_product(x_factors, target), compute_inner_product(y_factors, target)
    determinant = np.maximum(aa * bb - ab**2, np.finfo(np.float64).tiny)
    return (ar * bb - br * ab) / determinant, (br * aa - ar * ab) / determinant
