"""The high band: acceleration matching with one degree of freedom, along the direction of the smallest peak force.

Above the limit of direction perception a person perceives the strength of a vibration but hardly its direction. The
reference acceleration is therefore reduced to a single signal of the same energy and played along a single direction d
of force. With g the norm of the device's response G d at a spectral line and w the force weight, the magnitude of the
force is that of the reduced reference times g / (g² + w). The direction is free: of those tried, that of the smallest
peak force is chosen. Sizes: N samples, m forces, p responses.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from equalizer.plant.identified_model import IdentifiedModel
from equalizer.plant.model_response import compute_model_response
from equalizer.signals.signal import ComplexArray, FloatArray

MIN_WEIGHT, MAX_WEIGHT = 1e-3, 1e-2
"""Allowed range of the weight of |force|², to be compared with |G|², (m/s² per N)². A smaller weight amplifies noise at
antiresonances; with a larger weight the level at lines of low gain is too low. Both chosen."""
DEFAULT_WEIGHT = 1e-3
"""Default weight of |force|² against |error|², (m/s² per N)²: the smallest allowed."""
SPIRAL_DIRECTION_COUNT = 64
"""Number of force directions over the half sphere that are tried in addition to the three axes. Chosen: neighbours
are then about 18 degrees apart, and the peak differs by little between them."""


class ResponseSource(Protocol):
    """Frequency response of a device, defined at any frequency."""

    def at(self, frequency_hz: FloatArray) -> ComplexArray:
        """Compute the complex response (lines, p, m), m/s² per N, at frequencies (lines,), Hz."""


@dataclass(frozen=True, slots=True, eq=False)
class ModelledResponse:
    """Frequency response of an identified state-space model as a `ResponseSource`, also outside the model's band."""

    model: IdentifiedModel

    def at(self, frequency_hz: FloatArray) -> ComplexArray:
        """Compute the response of the model, (lines, p, m), m/s² per N, at frequencies (lines,), Hz."""
        return compute_model_response(self.model, frequency_hz)


@dataclass(frozen=True, slots=True, eq=False)
class MeasuredResponse:
    """Measured frequency response as a `ResponseSource`. Magnitude and unwrapped phase are interpolated linearly
    between the lines, and constant below the first and above the last line."""

    frequency_hz: FloatArray
    """(lines,), Hz, rising."""
    response: ComplexArray
    """(lines, p, m), m/s² per N."""

    def at(self, frequency_hz: FloatArray) -> ComplexArray:
        """Interpolate the response, (lines, p, m), m/s² per N, at frequencies (lines,), Hz."""
        flat_response = self.response.reshape(len(self.frequency_hz), -1)
        interpolated_channels = []
        for channel_response in flat_response.T:
            magnitude = np.interp(frequency_hz, self.frequency_hz, np.abs(channel_response))
            phase = np.interp(frequency_hz, self.frequency_hz, np.unwrap(np.angle(channel_response)))
            interpolated_channels.append(magnitude * np.exp(1j * phase))
        return np.stack(interpolated_channels, axis=1).reshape(len(frequency_hz), *self.response.shape[1:])


@dataclass(frozen=True, slots=True)
class HighBandSettings:
    """Settings of the high band. Raises ValueError for a weight outside `MIN_WEIGHT` to `MAX_WEIGHT`."""

    weight: float = DEFAULT_WEIGHT
    """Weight of |force|², (m/s² per N)²."""
    oblique_directions: bool = True
    """Whether directions between the axes are tried (three axes only); False = the axes alone."""
    causal: bool = False
    """Whether forces start with the first row: the inverse then has the same magnitude and minimum phase."""

    def __post_init__(self) -> None:
        if not MIN_WEIGHT <= self.weight <= MAX_WEIGHT:
            raise ValueError(f"weight is {self.weight}; it must be within {MIN_WEIGHT:g} and {MAX_WEIGHT:g}")


@dataclass(frozen=True, slots=True, eq=False)
class HighBandForces:
    """Forces along the tried direction with the smallest peak; result of `compute_high_band_forces`."""

    forces: FloatArray
    """(N, m), N."""
    direction: FloatArray
    """(m,): unit vector of the force."""
    peak_n: float
    """Peak (N) of the norm of the sum of these and the added forces."""
    peak_by_axis_n: FloatArray
    """(m,): that peak (N) for forces along each single axis, with the better sign, for comparison."""


def reduce_to_one_dof(reference: FloatArray) -> FloatArray:
    """Reduce (N, p) to (N,) by spectrum: at each line the norm over all axes with the phase of their sum. The energy
    of every line is preserved (Landin et al., Dimensional reduction of high-frequency accelerations for haptic
    rendering, 2010)."""
    spectrum = np.fft.rfft(reference, axis=0)
    magnitude = np.linalg.norm(spectrum, axis=1)
    # The sum over axes vanishes to rounding (1e-9) where axes cancel; the phase is then that of the strongest axis.
    spectrum_sum = spectrum.sum(axis=1)
    strongest_spectrum = np.take_along_axis(spectrum, np.abs(spectrum).argmax(axis=1)[:, None], axis=1)[:, 0]
    phase = np.angle(np.where(np.abs(spectrum_sum) > 1e-9 * magnitude, spectrum_sum, strongest_spectrum))
    return np.asarray(np.fft.irfft(magnitude * np.exp(1j * phase), len(reference)))


def project_to_one_dof(reference: FloatArray) -> FloatArray:
    """Project (N, p) to (N,), N >= 1, on the first principal direction, scaled to the energy of all axes. Unlike
    `reduce_to_one_dof` it is causal: each row depends on the same row of `reference`, apart from direction and
    scale."""
    direction = np.linalg.svd(reference, full_matrices=False)[2][0]
    projected_reference = reference @ direction
    projected_norm = float(np.linalg.norm(projected_reference))
    return np.asarray(
        projected_reference * (np.linalg.norm(reference) / projected_norm)
        if projected_norm > 0
        else projected_reference
    )


def compute_high_band_forces(
    reference: FloatArray,
    sample_rate_hz: float,
    source: ResponseSource,
    added_forces: FloatArray | None = None,
    settings: HighBandSettings | None = None,
) -> HighBandForces:
    """Compute the forces along the direction of the smallest peak. reference: (N,), m/s², one degree of freedom; unless
    causal, at rest at both ends, because the two-sided inverse is circular. added_forces: (N, m), N, forces of the
    other bands, which are included in the peak; None = zeros. settings: None = defaults."""
    settings = settings or HighBandSettings()
    fft_length = 2 * len(reference) if settings.causal else len(reference)
    response = source.at(compute_lines_hz(fft_length, sample_rate_hz))
    added_forces_n = (
        np.zeros((len(reference), response.shape[2]))
        if added_forces is None
        else np.asarray(added_forces, dtype=np.float64)
    )
    spectrum = np.fft.rfft(reference, fft_length)
    candidate_directions = _list_candidate_directions(response.shape[2], settings.oblique_directions)
    force_signals = [
        _compute_force_along(spectrum, fft_length, response @ direction, settings) for direction in candidate_directions
    ]
    # The sign of the direction is not perceived, but it changes the peak of the sum with the other forces.
    candidate_forces = [
        sign * signal[:, None] * unit_vector
        for signal, unit_vector in zip(force_signals, candidate_directions, strict=True)
        for sign in (1.0, -1.0)
    ]
    peaks_n = np.array(
        [np.linalg.norm(forces + added_forces_n, axis=1).max(initial=0.0) for forces in candidate_forces]
    )
    best_index = int(peaks_n.argmin())
    peak_by_axis_n = peaks_n.reshape(-1, 2).min(axis=1)[: response.shape[2]]
    return HighBandForces(
        candidate_forces[best_index], candidate_directions[best_index // 2], float(peaks_n[best_index]), peak_by_axis_n
    )


def predict_acceleration(forces: FloatArray, sample_rate_hz: float, source: ResponseSource) -> FloatArray:
    """Predict (N, p), m/s²: response of the source to forces (N, m), in N, from rest; zero-padded to twice the
    length."""
    fft_length = 2 * len(forces)
    spectrum = np.fft.rfft(forces, fft_length, axis=0)[:, :, None]
    response = (source.at(compute_lines_hz(fft_length, sample_rate_hz)) @ spectrum)[:, :, 0]
    return np.asarray(np.fft.irfft(response, fft_length, axis=0)[: len(forces)])


def compute_lines_hz(sample_count: int, sample_rate_hz: float) -> FloatArray:
    """Compute the frequencies (Hz), (sample_count // 2 + 1,), of the lines of a real FFT of sample_count samples."""
    return np.asarray(np.fft.rfftfreq(sample_count, 1 / sample_rate_hz), dtype=np.float64)


def _compute_force_along(
    spectrum: ComplexArray, fft_length: int, response: ComplexArray, settings: HighBandSettings
) -> FloatArray:
    """Compute the force along a direction, (N,), N. spectrum: of the reduced reference, fft_length samples; response:
    (lines, p), response to a unit force along the direction, m/s² per N."""
    gain = np.linalg.norm(response, axis=1)
    inverse = (gain / (gain**2 + settings.weight)).astype(np.complex128)
    if settings.causal:
        # At twice the length, so that the filter's decay does not wrap around to the start.
        return np.asarray(np.fft.irfft(spectrum * compute_minimum_phase(inverse.real), fft_length)[: fft_length // 2])
    strongest_channel = np.take_along_axis(response, np.abs(response).argmax(axis=1)[:, None], axis=1)[:, 0]
    # The strongest axis is in phase with the reduced reference.
    return np.asarray(np.fft.irfft(spectrum * inverse * np.exp(-1j * np.angle(strongest_channel)), fft_length))


def compute_minimum_phase(gain: FloatArray) -> ComplexArray:
    """Compute the minimum-phase response (lines,) of a gain (lines,), of a real FFT of even length, none negative, by
    folding the real cepstrum (Oppenheim and Schafer, Discrete-Time Signal Processing)."""
    fft_length = 2 * (len(gain) - 1)
    # A zero, as at 0 Hz, has no logarithm: it is replaced by the rounding error of the largest gain.
    min_gain = max(np.finfo(float).eps * float(gain.max()), np.finfo(float).tiny)
    cepstrum = np.fft.irfft(np.log(np.maximum(gain, min_gain)), fft_length)
    cepstrum[1 : fft_length // 2] *= 2
    cepstrum[fft_length // 2 + 1 :] = 0
    return np.asarray(np.exp(np.fft.rfft(cepstrum)))


def _list_candidate_directions(input_count: int, with_oblique: bool) -> list[FloatArray]:
    """List the unit vectors (input_count,) that are tried: the axes; with three inputs, if `with_oblique`, also a
    golden-angle spiral over the half sphere."""
    axes = list(np.eye(input_count))
    if not with_oblique or input_count != 3:
        return axes
    z = 1 - (2 * np.arange(SPIRAL_DIRECTION_COUNT) + 1) / (2 * SPIRAL_DIRECTION_COUNT)
    azimuth = np.pi * (1 + np.sqrt(5)) * np.arange(SPIRAL_DIRECTION_COUNT)
    radius = np.sqrt(1 - z**2)
    return axes + list(np.stack([radius * np.cos(azimuth), radius * np.sin(azimuth), z], axis=1))
