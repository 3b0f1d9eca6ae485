"""Resonances of an identified model within its band, without the fit's spurious poles.

A model of order 26 of a device with four resonances in the band holds more poles there than four: some share a
resonance between them, some answer noise. So poles only start the search: resonances are fitted to the model's own
response, all at once, each with a pole and residues of its own, beside a smooth remainder that is free.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from equalizer.plant.identified_model import IdentifiedModel
from equalizer.plant.model_response import model_response
from equalizer.signals.signal import ComplexArray, FloatArray

BAND_MARGIN = 0.12
"""A resonance may lie this far outside the band, relative: its slope is inside."""
LARGEST_DAMPING = 0.25
"""Largest damping ratio of what counts as a resonance; the rest is smooth."""
LEAST_SHARE = 0.04
"""Least share of a resonance in the response, at the line of the band where the resonance is largest."""
LARGEST_DRIFT = 0.1
"""A start that moves further in the fit, relative, was no resonance."""
TERMS_PER_OCTAVE = 1.7
"""Number of Chebyshev polynomials in log frequency, per octave, that describe the smooth remainder."""
LINES_PER_OCTAVE = 100
"""Lines per octave on which modes are fitted to a model's response."""


@dataclass(frozen=True, slots=True, eq=False)
class BandMode:
    """One pole pair: R / (z - pole) and its conjugate."""

    natural_hz: float
    damping_ratio: float
    residue: ComplexArray
    """(p, m)"""
    share: float
    """Largest part of the response that it makes up, over the lines of the band."""
    sample_rate_hz: float

    @property
    def pole(self) -> complex:
        """Discrete pole with the positive imaginary part, exp(s / sample_rate_hz)."""
        return complex(_poles(np.array([self.natural_hz]), np.array([self.damping_ratio]), self.sample_rate_hz)[0])

    def response(self, z: ComplexArray) -> ComplexArray:
        """(lines, p, m): response at points z (lines,) of the unit circle."""
        upper, lower = 1 / (z - self.pole), 1 / (z - self.pole.conjugate())
        return np.asarray(upper[:, None, None] * self.residue + lower[:, None, None] * self.residue.conj())


@dataclass(frozen=True, slots=True, eq=False)
class BandLines:
    """A model's response where its modes are looked for."""

    frequency_hz: FloatArray
    z: ComplexArray
    """(lines,): these frequencies as points of the unit circle."""
    response: ComplexArray
    """(lines, p, m)"""
    size: FloatArray
    """(lines,): Frobenius norm of the response."""
    in_band: np.ndarray[tuple[int], np.dtype[np.bool_]]
    """(lines,): in the band itself."""

    @property
    def smooth_basis(self) -> FloatArray:
        """(lines, terms)"""
        log = np.log(self.frequency_hz)
        octaves = (log[-1] - log[0]) / np.log(2)
        return np.polynomial.chebyshev.chebvander(
            2 * (log - log[0]) / (log[-1] - log[0]) - 1, int(np.ceil(TERMS_PER_OCTAVE * octaves))
        )


def band_lines(model: IdentifiedModel, band_hz: tuple[float, float]) -> BandLines:
    """The model's response on a logarithmic grid of LINES_PER_OCTAVE, over the band and half of BEYOND to either
    side."""
    low, high = band_hz
    widened = (low * (1 - BAND_MARGIN / 2), min(high * (1 + BAND_MARGIN / 2), 0.49 * model.sample_rate_hz))
    count = int(np.ceil(LINES_PER_OCTAVE * np.log2(widened[1] / widened[0])))
    frequency_hz = np.geomspace(*widened, count)
    response = model_response(model, frequency_hz)
    return BandLines(
        frequency_hz,
        np.exp(2j * np.pi * frequency_hz / model.sample_rate_hz),
        response,
        np.linalg.norm(response, axis=(1, 2)),
        (frequency_hz >= low) & (frequency_hz <= high),
    )


def band_modes(model: IdentifiedModel, band_hz: tuple[float, float]) -> tuple[BandMode, ...]:
    """Resonances by rising frequency, without those that are too damped or too weak."""
    lines = band_lines(model, band_hz)
    starts = _starts(model, band_hz)
    while len(starts):
        fitted, residues = _fit_modes(lines, starts, model.sample_rate_hz)
        modes = [
            _make_mode(lines, pair, residue, model.sample_rate_hz)
            for pair, residue in zip(fitted, residues, strict=True)
        ]
        is_resonance = np.array(
            [_is_resonance(mode, start, band_hz) for mode, start in zip(modes, starts, strict=True)]
        )
        if is_resonance.all():
            return tuple(sorted(modes, key=lambda mode: mode.natural_hz))
        starts = starts[is_resonance]
    return ()


def _starts(model: IdentifiedModel, band_hz: tuple[float, float]) -> FloatArray:
    """(modes, 2): natural frequency and damping ratio; poles nearer than their width are one resonance."""
    poles, vectors = np.linalg.eig(model.A)
    driven = np.linalg.solve(vectors, model.B.astype(complex))
    weight = np.linalg.norm(model.C @ vectors, axis=0) * np.linalg.norm(driven, axis=1)
    upper = poles.imag > 1e-9
    continuous = np.log(poles[upper]) * model.sample_rate_hz
    natural, damping = np.abs(continuous) / (2 * np.pi), -continuous.real / np.abs(continuous)
    weight = weight[upper]
    low, high = band_hz
    is_candidate = (
        (damping < LARGEST_DAMPING) & (natural > low * (1 - BAND_MARGIN)) & (natural < high * (1 + BAND_MARGIN))
    )
    merged: list[tuple[float, float, float]] = []
    for f, d, w in sorted(zip(natural[is_candidate], damping[is_candidate], weight[is_candidate], strict=True)):
        if merged and f - merged[-1][0] < max(d * f, merged[-1][0] * merged[-1][1]):
            f0, d0, w0 = merged.pop()
            f, d, w = (w0 * f0 + w * f) / (w0 + w), (w0 * d0 + w * d) / (w0 + w), w0 + w
        merged.append((float(f), float(d), float(w)))
    return np.array([(f, d) for f, d, _ in merged], dtype=np.float64).reshape(-1, 2)


def _fit_modes(lines: BandLines, starts: FloatArray, rate_hz: float) -> tuple[FloatArray, ComplexArray]:
    """Variable projection: poles are searched, residues and remainder are linear. Returns natural frequencies and
    damping ratios (modes, 2), and residues (modes, p, m)."""
    size = lines.size[:, None]
    target = _real_rows((lines.response.reshape(len(size), -1)) / size)
    smooth = lines.smooth_basis / size

    def basis(logs: FloatArray) -> FloatArray:
        natural, damping = np.exp(logs.reshape(-1, 2)).T
        poles = _poles(natural, np.minimum(damping, 0.95), rate_hz)
        upper, lower = 1 / (lines.z[:, None] - poles), 1 / (lines.z[:, None] - poles.conj())
        return _real_rows(np.hstack([(upper + lower) / size, 1j * (upper - lower) / size, smooth, 1j * smooth]))

    def residual(logs: FloatArray) -> FloatArray:
        orthonormal = np.linalg.qr(basis(logs))[0]
        return np.asarray(target - orthonormal @ (orthonormal.T @ target)).ravel()

    # A floor under the damping keeps the first pole of a spurious pair from sitting on the circle.
    first = np.log(np.maximum(starts, [0.0, 1e-3]))
    solution = least_squares(residual, first.ravel(), method="lm", x_scale=0.01, max_nfev=400)
    linear = np.linalg.lstsq(basis(solution.x), target, rcond=None)[0]
    modes, shape = len(starts), lines.response.shape[1:]
    residues = (linear[:modes] + 1j * linear[modes : 2 * modes]).reshape(modes, *shape)
    return np.exp(solution.x.reshape(-1, 2)), residues


def _is_resonance(mode: BandMode, start: FloatArray, band_hz: tuple[float, float]) -> bool:
    low, high = band_hz
    return bool(
        abs(mode.natural_hz / start[0] - 1) < LARGEST_DRIFT
        and mode.damping_ratio < LARGEST_DAMPING
        and low * (1 - BAND_MARGIN) < mode.natural_hz < high * (1 + BAND_MARGIN)
        and mode.share >= LEAST_SHARE
    )


def _make_mode(lines: BandLines, pair: FloatArray, residue: ComplexArray, rate_hz: float) -> BandMode:
    without_share = BandMode(float(pair[0]), min(float(pair[1]), 0.95), residue, 0.0, rate_hz)
    part = np.linalg.norm(without_share.response(lines.z), axis=(1, 2)) / lines.size
    return BandMode(
        without_share.natural_hz, without_share.damping_ratio, residue, float(part[lines.in_band].max()), rate_hz
    )


def _poles(natural_hz: FloatArray, damping_ratio: FloatArray, rate_hz: float) -> ComplexArray:
    s = 2 * np.pi * natural_hz * (-damping_ratio + 1j * np.sqrt(1 - damping_ratio**2))
    return np.asarray(np.exp(s / rate_hz), dtype=np.complex128)


def _real_rows(rows: ComplexArray) -> FloatArray:
    return np.vstack([rows.real, rows.imag])
