"""Least-squares fit of a single resonance to the lines around a peak, for many draws of the noise at once.

All entries of a response matrix share the pole pair; each has its own numerator, a parabola in s, which also represents
the modes outside the interval:  G(s) = (n0 + n1 s + n2 s²) / (s² + c1 s + c0),  with s = j f / f_m and f_m the
geometric middle of the lines. Natural frequency f_m sqrt(c0), damping ratio c1 / (2 sqrt(c0)).
"""

import numpy as np

from equalizer.signals.signal import ComplexArray, FloatArray

_STARTING_ROUNDS, _NEWTON_ROUNDS = 3, 8
"""Number of reweighted linear fits that give a starting value, and of Gauss-Newton steps from it."""


def fit_single_mode(frequency_hz: FloatArray, entries: ComplexArray) -> tuple[FloatArray, FloatArray]:
    """Natural frequency (draws,) in Hz and damping ratio (draws,); NaN where the fit is unstable or its natural
    frequency is outside the lines. frequency_hz: (lines,), at least six. entries: (draws, lines, entries of the
    matrix).

    Re-weighted linear equations (Sanathanan and Koerner) give starting values, whose damping is biased by noise;
    Gauss-Newton steps on the least-squares error remove that bias (variable projection, Kaufman 1975).
    """
    middle = float(np.sqrt(frequency_hz[0] * frequency_hz[-1]))
    s = np.asarray(1j * frequency_hz / middle, dtype=np.complex128)
    numerator = np.stack([np.ones_like(s), s, s**2], axis=1)
    c1, c0 = np.zeros(len(entries)), np.ones(len(entries))
    inverse_denominator: ComplexArray = np.ones((len(entries), len(s)), dtype=np.complex128)
    for _ in range(_STARTING_ROUNDS):
        basis = _basis(numerator, inverse_denominator)
        constant_term, first, second = (
            _project_out(basis, entries * (factor * inverse_denominator)[:, :, None]) for factor in (s**2, s, 1.0)
        )
        c1, c0 = _solve_two_unknowns(first, second, -constant_term)
        inverse_denominator = _inverse_denominator(s, c1, c0)
    for _ in range(_NEWTON_ROUNDS):
        basis = _basis(numerator, inverse_denominator)
        remainder = _project_out(basis, entries)
        fitted = (entries - remainder) * inverse_denominator[:, :, None]
        step1, step0 = _solve_two_unknowns(
            _project_out(basis, fitted * s[:, None]), _project_out(basis, fitted), -remainder
        )
        c1, c0 = c1 + np.clip(step1, -0.05, 0.05), c0 + np.clip(step0, -0.05, 0.05)
        inverse_denominator = _inverse_denominator(s, c1, c0)
    root = np.sqrt(np.maximum(c0, np.finfo(np.float64).tiny))
    natural, damping = middle * root, c1 / (2 * root)
    fits = (c1 > 0) & (natural > frequency_hz[0]) & (natural < frequency_hz[-1])
    return np.where(fits, natural, np.nan), np.where(fits, damping, np.nan)


def _inverse_denominator(s: ComplexArray, c1: FloatArray, c0: FloatArray) -> ComplexArray:
    """(draws, lines): 1 / (s² + c1 s + c0)."""
    inverse: ComplexArray = 1 / (s**2 + c1[:, None] * s + c0[:, None])
    return inverse


def _basis(numerator: ComplexArray, inverse_denominator: ComplexArray) -> ComplexArray:
    """(draws, lines, 3): orthonormal basis of the functions (n0 + n1 s + n2 s²) / (s² + c1 s + c0)."""
    basis: ComplexArray = np.linalg.qr(numerator * inverse_denominator[:, :, None])[0]
    return basis


def _project_out(basis: ComplexArray, values: ComplexArray) -> ComplexArray:
    """Residual of values (draws, lines, entries) after projection on the basis."""
    remainder: ComplexArray = values - basis @ (np.conj(basis.swapaxes(1, 2)) @ values)
    return remainder


def _solve_two_unknowns(
    first: ComplexArray, second: ComplexArray, target: ComplexArray
) -> tuple[FloatArray, FloatArray]:
    """Real x and y, (draws,) each, that solve first x + second y = right in least squares, draw by draw."""

    def dot(first_values: ComplexArray, second_values: ComplexArray) -> FloatArray:
        product: FloatArray = np.sum((np.conj(first_values) * second_values).real, axis=(1, 2))
        return product

    aa, ab, bb = dot(first, first), dot(first, second), dot(second, second)
    ar, br = dot(first, target), dot(second, target)
    determinant = np.maximum(aa * bb - ab**2, np.finfo(np.float64).tiny)
    return (ar * bb - br * ab) / determinant, (br * aa - ar * ab) / determinant
