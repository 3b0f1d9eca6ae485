"""Resonances of an identified model within its band, without the spurious poles of its fit.

A model may have more pole pairs in the band than the device has resonances there: several pairs may describe a single
resonance, or the noise of the measurement. The model's poles therefore only give start values: a pole pair with
residues for each resonance, and a smooth remainder with free coefficients, are fitted together to the model's response.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from equalizer.plant.identified_model import IdentifiedModel
from equalizer.plant.model_response import compute_model_response
from equalizer.signals.signal import ComplexArray, FloatArray

BAND_MARGIN = 0.12
"""Distance of a resonance outside the band, relative to the band edge, up to which it is kept: its slope is inside.
Heuristic, like all constants here."""
MAX_DAMPING_RATIO = 0.25
"""Damping ratio from which a pole pair no longer counts as a resonance; such parts belong to the smooth remainder."""
MIN_SHARE = 0.04
"""Smallest share of a resonance in the norm of the response, at the line of the band where this share is largest."""
MAX_FREQUENCY_CHANGE = 0.1
"""Largest relative change of the natural frequency from its start value in the fit; a start value that moves further
described no resonance."""
TERMS_PER_OCTAVE = 1.7
"""Degree of the polynomial that describes the smooth remainder, in Chebyshev polynomials of log frequency, per
octave."""
LINES_PER_OCTAVE = 100
"""Lines per octave on which modes are fitted to a model's response."""


@dataclass(frozen=True, slots=True, eq=False)
class BandMode:
    """A pole pair of a resonance: R / (z - pole) plus its complex conjugate at the conjugate pole."""

    natural_hz: float
    damping_ratio: float
    residue: ComplexArray
    """R, (p, m), in m/s² per N."""
    share: float
    """Norm of the mode's response over the norm of the model's response, the largest value over the lines of the
    band."""
    sample_rate_hz: float

    @property
    def pole(self) -> complex:
        """Discrete pole with the positive imaginary part, exp(s / sample_rate_hz)."""
        return complex(
            _compute_poles(np.array([self.natural_hz]), np.array([self.damping_ratio]), self.sample_rate_hz)[0]
        )

    def compute_response(self, z: ComplexArray) -> ComplexArray:
        """(lines, p, m): response of the pole pair at points z (lines,) of the unit circle."""
        positive_pole_term, negative_pole_term = 1 / (z - self.pole), 1 / (z - self.pole.conjugate())
        return np.asarray(
            positive_pole_term[:, None, None] * self.residue + negative_pole_term[:, None, None] * self.residue.conj()
        )


@dataclass(frozen=True, slots=True, eq=False)
class BandLines:
    """A model's response at the lines at which its modes are fitted; made by `compute_band_lines`."""

    frequency_hz: FloatArray
    z: ComplexArray
    """(lines,): these frequencies as points of the unit circle."""
    response: ComplexArray
    """(lines, p, m)"""
    response_norm: FloatArray
    """(lines,): Frobenius norm of the response."""
    in_band: np.ndarray[tuple[int], np.dtype[np.bool_]]
    """(lines,): whether a line is in the band itself, not in its margin."""

    @property
    def smooth_basis(self) -> FloatArray:
        """(lines, terms): Chebyshev polynomials of log frequency, the basis of the smooth remainder."""
        log_frequency = np.log(self.frequency_hz)
        octaves = (log_frequency[-1] - log_frequency[0]) / np.log(2)
        return np.polynomial.chebyshev.chebvander(
            2 * (log_frequency - log_frequency[0]) / (log_frequency[-1] - log_frequency[0]) - 1,
            int(np.ceil(TERMS_PER_OCTAVE * octaves)),
        )


def compute_band_lines(model: IdentifiedModel, band_hz: tuple[float, float]) -> BandLines:
    """Compute the model's response on a logarithmic grid of LINES_PER_OCTAVE, over the band (Hz) and half of
    BAND_MARGIN on either side, but at most 0.49 of the sample rate, just below half of it."""
    low_hz, high_hz = band_hz
    widened_band_hz = (
        low_hz * (1 - BAND_MARGIN / 2),
        min(high_hz * (1 + BAND_MARGIN / 2), 0.49 * model.sample_rate_hz),
    )
    line_count = int(np.ceil(LINES_PER_OCTAVE * np.log2(widened_band_hz[1] / widened_band_hz[0])))
    frequency_hz = np.geomspace(*widened_band_hz, line_count)
    response = compute_model_response(model, frequency_hz)
    return BandLines(
        frequency_hz,
        np.exp(2j * np.pi * frequency_hz / model.sample_rate_hz),
        response,
        np.linalg.norm(response, axis=(1, 2)),
        (frequency_hz >= low_hz) & (frequency_hz <= high_hz),
    )


def find_band_modes(model: IdentifiedModel, band_hz: tuple[float, float]) -> tuple[BandMode, ...]:
    """Find the resonances in the band (Hz), by rising frequency. All are fitted together; those that fail
    `_is_resonance` are removed and the fit is repeated until all pass. Empty without any."""
    lines = compute_band_lines(model, band_hz)
    start_values = _find_start_values(model, band_hz)
    while len(start_values):
        frequencies_and_dampings, residues = _fit_modes(lines, start_values, model.sample_rate_hz)
        modes = [
            _make_mode(lines, frequency_and_damping, residue, model.sample_rate_hz)
            for frequency_and_damping, residue in zip(frequencies_and_dampings, residues, strict=True)
        ]
        is_resonance = np.array(
            [_is_resonance(mode, start_value, band_hz) for mode, start_value in zip(modes, start_values, strict=True)]
        )
        if is_resonance.all():
            return tuple(sorted(modes, key=lambda mode: mode.natural_hz))
        start_values = start_values[is_resonance]
    return ()


def _find_start_values(model: IdentifiedModel, band_hz: tuple[float, float]) -> FloatArray:
    """Find natural frequency (Hz) and damping ratio of the model's weakly damped poles in and near the band, (modes,
    2), by rising frequency. Neighbours whose distance is below the larger half bandwidth (damping ratio times natural
    frequency) are merged, weighted by their modal gain."""
    poles, mode_shapes = np.linalg.eig(model.A)
    modal_inputs = np.linalg.solve(mode_shapes, model.B.astype(complex))
    modal_gain = np.linalg.norm(model.C @ mode_shapes, axis=0) * np.linalg.norm(modal_inputs, axis=1)
    # A pole with an imaginary part of at most 1e-9 is real up to rounding; of a conjugate pair one pole is kept.
    has_positive_imaginary = poles.imag > 1e-9
    continuous_poles = np.log(poles[has_positive_imaginary]) * model.sample_rate_hz
    natural_hz, damping_ratio = (
        np.abs(continuous_poles) / (2 * np.pi),
        -continuous_poles.real / np.abs(continuous_poles),
    )
    modal_gain = modal_gain[has_positive_imaginary]
    low_hz, high_hz = band_hz
    is_candidate = (
        (damping_ratio < MAX_DAMPING_RATIO)
        & (natural_hz > low_hz * (1 - BAND_MARGIN))
        & (natural_hz < high_hz * (1 + BAND_MARGIN))
    )
    merged_modes: list[tuple[float, float, float]] = []
    for mode_hz, damping, gain in sorted(
        zip(natural_hz[is_candidate], damping_ratio[is_candidate], modal_gain[is_candidate], strict=True)
    ):
        if merged_modes and mode_hz - merged_modes[-1][0] < max(
            damping * mode_hz, merged_modes[-1][0] * merged_modes[-1][1]
        ):
            previous_hz, previous_damping, previous_gain = merged_modes.pop()
            mode_hz, damping, gain = (
                (previous_gain * previous_hz + gain * mode_hz) / (previous_gain + gain),
                (previous_gain * previous_damping + gain * damping) / (previous_gain + gain),
                previous_gain + gain,
            )
        merged_modes.append((float(mode_hz), float(damping), float(gain)))
    return np.array([(mode_hz, damping) for mode_hz, damping, _ in merged_modes], dtype=np.float64).reshape(-1, 2)


def _fit_modes(lines: BandLines, start_values: FloatArray, rate_hz: float) -> tuple[FloatArray, ComplexArray]:
    """Fit by variable projection (Golub and Pereyra 1973): natural frequencies and damping ratios are searched by least
    squares, residues and remainder follow linearly. The misfit is relative to the norm of the response at each line.
    start_values: as returned by `_find_start_values`. Returns natural frequencies (Hz) and damping ratios (modes, 2),
    and residues (modes, p, m)."""
    response_norm = lines.response_norm[:, None]
    target = _stack_real_and_imaginary((lines.response.reshape(len(response_norm), -1)) / response_norm)
    remainder_basis = lines.smooth_basis / response_norm

    def compute_basis(log_parameters: FloatArray) -> FloatArray:
        """Real basis functions of all modes and of the remainder, (2 lines, columns), for log natural frequencies and
        log damping ratios (2 modes,)."""
        natural_hz, damping_ratio = np.exp(log_parameters.reshape(-1, 2)).T
        poles = _compute_poles(natural_hz, np.minimum(damping_ratio, 0.95), rate_hz)
        positive_pole_terms, negative_pole_terms = 1 / (lines.z[:, None] - poles), 1 / (lines.z[:, None] - poles.conj())
        return _stack_real_and_imaginary(
            np.hstack(
                [
                    (positive_pole_terms + negative_pole_terms) / response_norm,
                    1j * (positive_pole_terms - negative_pole_terms) / response_norm,
                    remainder_basis,
                    1j * remainder_basis,
                ]
            )
        )

    def compute_residual(log_parameters: FloatArray) -> FloatArray:
        """Part of the response outside the span of the basis functions, flattened."""
        orthonormal = np.linalg.qr(compute_basis(log_parameters))[0]
        return np.asarray(target - orthonormal @ (orthonormal.T @ target)).ravel()

    # A lower limit of the damping ratio, 1e-3, keeps the first values of spurious poles off the unit circle; an upper
    # limit of 0.95, in `compute_basis` and `_make_mode`, keeps the poles complex: a mode near it is no resonance
    # (`MAX_DAMPING_RATIO`). Steps are scaled to 1 % of a parameter; 400 evaluations bound the time, converged or not.
    log_start = np.log(np.maximum(start_values, [0.0, 1e-3]))
    solution = least_squares(compute_residual, log_start.ravel(), method="lm", x_scale=0.01, max_nfev=400)
    coefficients = np.linalg.lstsq(compute_basis(solution.x), target, rcond=None)[0]
    mode_count, response_shape = len(start_values), lines.response.shape[1:]
    residues = (coefficients[:mode_count] + 1j * coefficients[mode_count : 2 * mode_count]).reshape(
        mode_count, *response_shape
    )
    return np.exp(solution.x.reshape(-1, 2)), residues


def _is_resonance(mode: BandMode, start_value: FloatArray, band_hz: tuple[float, float]) -> bool:
    """Whether a fitted mode is a resonance: near its start value (natural frequency, damping ratio), weakly damped, in
    the band (Hz) or its margin, and large enough in the response."""
    low_hz, high_hz = band_hz
    return bool(
        abs(mode.natural_hz / start_value[0] - 1) < MAX_FREQUENCY_CHANGE
        and mode.damping_ratio < MAX_DAMPING_RATIO
        and low_hz * (1 - BAND_MARGIN) < mode.natural_hz < high_hz * (1 + BAND_MARGIN)
        and mode.share >= MIN_SHARE
    )


def _make_mode(lines: BandLines, frequency_and_damping: FloatArray, residue: ComplexArray, rate_hz: float) -> BandMode:
    """Mode of a fitted natural frequency (Hz) and damping ratio, (2,), with its share in the response. residue: (p,
    m)."""
    mode = BandMode(float(frequency_and_damping[0]), min(float(frequency_and_damping[1]), 0.95), residue, 0.0, rate_hz)
    shares = np.linalg.norm(mode.compute_response(lines.z), axis=(1, 2)) / lines.response_norm
    return BandMode(mode.natural_hz, mode.damping_ratio, residue, float(shares[lines.in_band].max()), rate_hz)


def _compute_poles(natural_hz: FloatArray, damping_ratio: FloatArray, rate_hz: float) -> ComplexArray:
    """(modes,): discrete poles exp(s / rate_hz) with positive imaginary part, for s = 2 pi f (-d + i sqrt(1 - d²))."""
    s = 2 * np.pi * natural_hz * (-damping_ratio + 1j * np.sqrt(1 - damping_ratio**2))
    return np.asarray(np.exp(s / rate_hz), dtype=np.complex128)


def _stack_real_and_imaginary(rows: ComplexArray) -> FloatArray:
    """(2 rows, columns): real parts above imaginary parts, for a real least-squares problem."""
    return np.vstack([rows.real, rows.imag])
