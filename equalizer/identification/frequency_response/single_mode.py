"""Fit of a single resonance to the lines around a peak: all entries share the pole, each has its own residues."""

import numpy as np

from equalizer.signals.signal import ComplexArray, FloatArray

_STARTING_ROUNDS, _NEWTON_ROUNDS = 3, 8
"""Reweighted linear fits that give a start, and Newton steps from it."""


def fit_single_mode(frequency_hz: FloatArray, entries: ComplexArray) -> tuple[FloatArray, FloatArray]:
    """Natural frequency (draws,) in Hz and damping ratio (draws,); NaN where no resonance fits.

    entries (draws, lines, entries): G = (a parabola in s per entry) / (s² + c1 s + c0) in least squares; the parabola
    represents modes that are further away. Started by re-weighted linear equations (Sanathanan and Koerner), whose
    damping is biased by noise; refined by Gauss-Newton steps on the least-squares error, which is not (variable
    projection, Kaufman 1975). frequency_hz: (lines,), at least six.
    """
    middle = float(np.sqrt(frequency_hz[0] * frequency_hz[-1]))
    s = np.asarray(1j * frequency_hz / middle, dtype=np.complex128)
    numerator = np.stack([np.ones_like(s), s, s**2], axis=1)
    c1, c0 = np.zeros(len(entries)), np.ones(len(entries))
    over: ComplexArray = np.ones((len(entries), len(s)), dtype=np.complex128)
    for _ in range(_STARTING_ROUNDS):
        basis = _basis(numerator, over)
        known, first, second = (_project_out(basis, entries * (factor * over)[:, :, None]) for factor in (s**2, s, 1.0))
        c1, c0 = _solve_two_unknowns(first, second, -known)
        over = _inverse_denominator(s, c1, c0)
    for _ in range(_NEWTON_ROUNDS):
        basis = _basis(numerator, over)
        remainder = _project_out(basis, entries)
        fitted = (entries - remainder) * over[:, :, None]
        step1, step0 = _solve_two_unknowns(
            _project_out(basis, fitted * s[:, None]), _project_out(basis, fitted), -remainder
        )
        c1, c0 = c1 + np.clip(step1, -0.05, 0.05), c0 + np.clip(step0, -0.05, 0.05)
        over = _inverse_denominator(s, c1, c0)
    root = np.sqrt(np.maximum(c0, np.finfo(np.float64).tiny))
    natural, damping = middle * root, c1 / (2 * root)
    fits = (c1 > 0) & (natural > frequency_hz[0]) & (natural < frequency_hz[-1])
    return np.where(fits, natural, np.nan), np.where(fits, damping, np.nan)


def _inverse_denominator(s: ComplexArray, c1: FloatArray, c0: FloatArray) -> ComplexArray:
    """(draws, lines): 1 over the denominator s² + c1 s + c0."""
    over: ComplexArray = 1 / (s**2 + c1[:, None] * s + c0[:, None])
    return over


def _basis(numerator: ComplexArray, over: ComplexArray) -> ComplexArray:
    """(draws, lines, 3): orthonormal basis of all numerators over the denominator."""
    basis: ComplexArray = np.linalg.qr(numerator * over[:, :, None])[0]
    return basis


def _project_out(basis: ComplexArray, values: ComplexArray) -> ComplexArray:
    """Residual of values (draws, lines, entries) after projection on the basis."""
    remainder: ComplexArray = values - basis @ (np.conj(basis.swapaxes(1, 2)) @ values)
    return remainder


def _solve_two_unknowns(
    first: ComplexArray, second: ComplexArray, right: ComplexArray
) -> tuple[FloatArray, FloatArray]:
    """Real least squares of first x + second y = right, draw by draw."""

    def dot(left: ComplexArray, other: ComplexArray) -> FloatArray:
        product: FloatArray = np.sum((np.conj(left) * other).real, axis=(1, 2))
        return product

    aa, ab, bb = dot(first, first), dot(first, second), dot(second, second)
    ar, br = dot(first, right), dot(second, right)
    determinant = np.maximum(aa * bb - ab**2, np.finfo(np.float64).tiny)
    return (ar * bb - br * ab) / determinant, (br * aa - ar * ab) / determinant
