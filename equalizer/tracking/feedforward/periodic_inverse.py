"""Commands for periodic outputs: the regularised (Tikhonov) inverse of a model's frequency response, line by line.

In the steady state every spectral line is independent: with the response G from forces to outputs and the weight w, the
forces H y with H = (G* G + w I)^-1 G* minimise |G f - y|² + w |f|² for the reference output y.
"""

from collections.abc import Sequence

import numpy as np

from equalizer.plant.identified_model import IdentifiedModel
from equalizer.plant.model_response import compute_model_response
from equalizer.signals.signal import ComplexArray, FloatArray, Signal
from equalizer.tracking.feedforward.virtual_spring import NO_SPRING, VirtualSpring

FORCE_WEIGHT = 1e-4
"""Weight w of |force|² against |acceleration error|², (m/s² per N)². Chosen: it lowers the response by
0.001 dB where the device's gain is 1 m/s² per N, and keeps the force finite at antiresonances."""

ROUNDING_SHARE = 1e-9
"""Fraction of the largest spectral line below which a line counts as a rounding error and gets no force. Chosen."""


class OutsideBandError(ValueError):
    """The reference signal has content outside the model's band."""


def compute_regularised_inverse(
    model: IdentifiedModel, frequency_hz: FloatArray, weight: float = FORCE_WEIGHT, spring: VirtualSpring = NO_SPRING
) -> ComplexArray:
    """Compute the commands per reference output, (lines, m, p), N per unit of the output: H = (G* G + weight I)^-1 G*,
    the total force that enters the plant, less the part of it that the virtual spring supplies."""
    G = compute_model_response(model, frequency_hz)
    H = invert_regularised(G, weight)
    if spring == NO_SPRING:
        return H
    spring_share = spring.compute_force_per_acceleration(frequency_hz)[:, None, None] * (G @ H)
    return np.asarray(H - spring_share)


def invert_regularised(G: ComplexArray, weight: float) -> ComplexArray:
    """Compute (G* G + weight I)^-1 G* at each spectral line. G: (lines, p, m); returns (lines, m, p)."""
    adjoint = np.conj(np.swapaxes(G, 1, 2))
    return np.asarray(np.linalg.solve(adjoint @ G + weight * np.eye(G.shape[2]), adjoint))


def compute_periodic_command(
    model: IdentifiedModel, reference: Signal, weight: float = FORCE_WEIGHT, spring: VirtualSpring = NO_SPRING
) -> Signal:
    """Compute one period of forces (N, m), in newtons, for one period of reference outputs (N, p), N >= 1.

    Raises OutsideBandError where the reference has content outside the model's band, ValueError as `check_reference`.
    """
    check_reference(model, reference)
    sample_count = len(reference)
    spectrum = np.fft.rfft(reference.samples, axis=0)
    frequency_hz = np.fft.rfftfreq(sample_count, 1.0 / reference.sample_rate_hz)
    magnitude = np.abs(spectrum).max(axis=1)
    is_used = magnitude > ROUNDING_SHARE * magnitude.max()
    check_band(model, frequency_hz[is_used])
    force_spectrum = np.zeros((len(spectrum), model.B.shape[1]), dtype=np.complex128)
    if is_used.any():
        H = compute_regularised_inverse(model, frequency_hz[is_used], weight, spring)
        force_spectrum[is_used] = np.einsum("lmp,lp->lm", H, spectrum[is_used])
    samples = np.fft.irfft(force_spectrum, sample_count, axis=0)
    return Signal(samples, reference.sample_rate_hz, "force", "N", model.input_channels)


def check_band(model: IdentifiedModel, frequency_hz: FloatArray) -> None:
    """Check that a model covers the frequencies of a signal. Raises OutsideBandError for a frequency outside the
    model's band, limits included, with a relative tolerance of 1e-9 for rounding."""
    low_hz, high_hz = model.band_hz
    outside_hz = [
        line_hz for line_hz in np.atleast_1d(frequency_hz) if not low_hz * (1 - 1e-9) <= line_hz <= high_hz * (1 + 1e-9)
    ]
    if outside_hz:
        listed_hz = ", ".join(f"{line_hz:g}" for line_hz in outside_hz[:5]) + (" ..." if len(outside_hz) > 5 else "")
        raise OutsideBandError(
            f"the model was made for {low_hz:g} to {high_hz:g} Hz, but the signal has content at {listed_hz} Hz; "
            "identify a model of a wider band (hapteq identify --band)"
        )


def check_reference(model: IdentifiedModel, reference: Signal) -> None:
    """Check a reference signal against the model. Raises ValueError for a signal whose rate, number of channels or
    units are not the model's, or that has the model's channels in another order, and for a model whose commands are not
    forces in N."""
    if reference.sample_rate_hz != model.sample_rate_hz:
        raise ValueError(
            f"the model runs at {model.sample_rate_hz:.12g} Hz, not at {reference.sample_rate_hz:.12g} Hz; "
            "resample the reference"
        )
    output_count = model.C.shape[0]
    if reference.samples.shape[1] != output_count:
        raise ValueError(
            f"the model has {output_count} outputs, but the reference has {reference.samples.shape[1]} channels"
        )
    if reference.channels != model.output_channels and set(reference.channels) == set(model.output_channels):
        raise ValueError(
            f"the model has the outputs {', '.join(model.output_channels)}, but the reference has the channels "
            f"{', '.join(reference.channels)}; put them in the same order"
        )
    if reference.units != model.output_units:
        raise ValueError(
            f"the model answers in {_format_units(model.output_units)}, but the reference is in "
            f"{_format_units(reference.units)}; both must agree, channel by channel"
        )
    if set(model.input_units) != {"N"}:
        raise ValueError(
            f"the model's commands are in {_format_units(model.input_units)}, but forces and their cap are in N; "
            "identify a model from forces in N, or use the tracker alone (stored_gains, track)"
        )


def _format_units(units: Sequence[str]) -> str:
    """Format the units of channels: one where all are equal, else all, separated by commas."""
    return ", ".join(units if len(set(units)) > 1 else units[:1])
