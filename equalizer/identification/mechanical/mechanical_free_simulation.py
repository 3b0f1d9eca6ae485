"""Free-simulation (output) error of a mechanical model on measured segments, by channel.

The error is computed from spectra: measured response minus the response to the commands minus that to the initial
state, which is fitted by least squares. By Parseval's theorem its power is that of a free simulation's error over the
segment, without the mean. Called by `mechanical_fit` and `analysis.diagnosis.first_model.choose_structure`.
"""

from collections.abc import Sequence

import numpy as np

from equalizer.identification.mechanical.mechanical_lines import SegmentLines
from equalizer.identification.mechanical.mechanical_response import compute_free_response, compute_sampled_response
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.signal import ComplexArray, FloatArray

_SILENT_AMPLITUDE = 1e-9
"""Rms response, relative to that of the strongest channel, up to which a channel counts as silent: rounding errors, as
where a converter shows the same number throughout. Chosen."""
_MAX_FITTED_LINES = 3000
"""Number of lines, up to a factor of two, to which the initial state is fitted; more are thinned out to limit computing
time. Chosen."""


def compute_simulation_errors(
    model: MechanicalModel, segments: Sequence[SegmentLines], band_hz: tuple[float, float]
) -> tuple[FloatArray, FloatArray]:
    """Compute two arrays (p + 1,) for p channels: rms error, and rms noise (NaN where not known), of each channel
    relative to the rms of its response (`_replace_silent`); the last entry is the root mean square over the channels.
    band_hz: lines from its lower to its upper limit, both included. Without a line in the band all errors are 0."""
    output_count = model.outputs
    error_power, response_power, noise_power = np.zeros(output_count), np.zeros(output_count), np.zeros(output_count)
    for segment in segments:
        is_in_band = (segment.frequency_hz >= band_hz[0]) & (segment.frequency_hz <= band_hz[1])
        misfit = compute_simulation_misfit(model, segment)[is_in_band]
        error_power += (np.abs(misfit) ** 2).sum(axis=0)
        response_power += (np.abs(segment.response[is_in_band]) ** 2).sum(axis=0)
        noise_power += segment.noise[is_in_band].sum(axis=0)
    reference_power = _replace_silent(response_power)
    error_shares, noise_shares = error_power / reference_power, noise_power / reference_power
    return (
        np.sqrt(np.append(error_shares, error_shares.mean())),
        np.sqrt(np.append(noise_shares, noise_shares.mean())),
    )


def compute_simulation_misfit(model: MechanicalModel, segment_lines: SegmentLines) -> ComplexArray:
    """Compute (lines, p): measured minus simulated spectrum, in the response's unit. Where the segment has a transient,
    the initial state is fitted by least squares, with each channel divided by the norm of its response
    (`_replace_silent`)."""
    frequency_response = compute_sampled_response(
        model, segment_lines.frequency_hz, segment_lines.rate_hz, segment_lines.hold
    )
    misfit = segment_lines.response - np.einsum("lpm,lm->lp", frequency_response, segment_lines.command)
    if not segment_lines.transient:
        return np.asarray(misfit)
    free_response = compute_free_response(model, segment_lines.frequency_hz, segment_lines.rate_hz)
    if model.quantity == "acceleration":  # the last command before the segment acts directly on the first response
        feedthrough = np.broadcast_to(np.eye(model.outputs), (len(free_response), model.outputs, model.outputs))
        free_response = np.concatenate([free_response, feedthrough], axis=2)
    stride = max(1, len(free_response) // _MAX_FITTED_LINES)
    # The initial state contributes mostly at low frequencies: all of the first 200 lines (chosen) are kept.
    fitted_lines = np.unique(
        np.concatenate([np.arange(min(200, len(free_response))), np.arange(0, len(free_response), stride)])
    )
    response_norm = np.sqrt(_replace_silent(np.linalg.norm(segment_lines.response, axis=0) ** 2))[:, None]
    weighted_response = (free_response[fitted_lines] / response_norm).reshape(-1, free_response.shape[2])
    weighted_misfit = (misfit[fitted_lines] / response_norm[:, 0]).ravel()
    # Real and imaginary parts are separate equations of real unknowns; columns are scaled to unit norm for rcond.
    real_matrix = np.concatenate([weighted_response.real, weighted_response.imag])
    column_norms = np.maximum(np.linalg.norm(real_matrix, axis=0), 1e-300)
    initial_state = (
        np.linalg.lstsq(
            real_matrix / column_norms, np.concatenate([weighted_misfit.real, weighted_misfit.imag]), rcond=1e-10
        )[0]
        / column_norms
    )
    return np.asarray(misfit - free_response @ initial_state)


def _replace_silent(response_power: FloatArray) -> FloatArray:
    """Replace the power of silent channels (`_SILENT_AMPLITUDE`) by the mean over all channels, because an error
    relative to rounding errors would outweigh all others. response_power: (p,), of the same quantity. At least 1e-300,
    which avoids a division by zero."""
    is_silent = response_power <= _SILENT_AMPLITUDE**2 * response_power.max()
    return np.maximum(np.where(is_silent, response_power.mean(), response_power), 1e-300)
