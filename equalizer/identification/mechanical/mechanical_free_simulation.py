"""Simulation error of a mechanical model on measured segments, channel by channel.

The error is computed from spectra: measured response minus the response to the commands minus that to the initial
state, which is fitted by least squares. By Parseval's theorem its power is that of a free simulation's error over the
segment, without the mean.
"""

from collections.abc import Sequence

import numpy as np

from equalizer.identification.mechanical.mechanical_lines import SegmentLines
from equalizer.identification.mechanical.mechanical_response import compute_free_response, compute_sampled_response
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.signal import ComplexArray, FloatArray

_STATE_LINES = 3000
"""Approximate number of lines to which the initial state is fitted; more are thinned out to limit computing time."""


def simulation_errors(
    model: MechanicalModel, segments: Sequence[SegmentLines], band_hz: tuple[float, float]
) -> tuple[FloatArray, FloatArray]:
    """Two arrays (p + 1,): rms error, and rms noise (NaN where not known), of each channel relative to the rms of its
    response; the last entry is the root mean square over the channels. band_hz: ends included."""
    p = model.outputs
    error, power, noise = np.zeros(p), np.zeros(p), np.zeros(p)
    for segment in segments:
        in_band = (segment.frequency_hz >= band_hz[0]) & (segment.frequency_hz <= band_hz[1])
        misfit = simulation_misfit(model, segment)[in_band]
        error += (np.abs(misfit) ** 2).sum(axis=0)
        power += (np.abs(segment.response[in_band]) ** 2).sum(axis=0)
        noise += segment.noise[in_band].sum(axis=0)
    shares, floor = error / np.maximum(power, 1e-300), noise / np.maximum(power, 1e-300)
    return (
        np.sqrt(np.append(shares, shares.mean())),
        np.sqrt(np.append(floor, floor.mean())),
    )


def simulation_misfit(model: MechanicalModel, segment_lines: SegmentLines) -> ComplexArray:
    """(lines, p): measured minus simulated spectrum, in the response's unit, with the best-fitting initial state where
    the segment has a transient."""
    response = compute_sampled_response(model, segment_lines.frequency_hz, segment_lines.rate_hz, segment_lines.hold)
    misfit = segment_lines.response - np.einsum("lpm,lm->lp", response, segment_lines.command)
    if not segment_lines.transient:
        return np.asarray(misfit)
    free = compute_free_response(model, segment_lines.frequency_hz, segment_lines.rate_hz)
    if model.quantity == "acceleration":  # the last command before the segment acts directly on the first response
        feedthrough = np.broadcast_to(np.eye(model.outputs), (len(free), model.outputs, model.outputs))
        free = np.concatenate([free, feedthrough], axis=2)
    stride = max(1, len(free) // _STATE_LINES)
    # The initial state contributes mostly at low frequencies: the first 200 lines are all kept, the others thinned out.
    fitted_lines = np.unique(np.concatenate([np.arange(min(200, len(free))), np.arange(0, len(free), stride)]))
    size = np.linalg.norm(segment_lines.response, axis=0)[:, None] + 1e-300
    columns = (free[fitted_lines] / size).reshape(-1, free.shape[2])
    target = (misfit[fitted_lines] / size[:, 0]).ravel()
    real = np.concatenate([columns.real, columns.imag])
    scale = np.maximum(np.linalg.norm(real, axis=0), 1e-300)
    state = np.linalg.lstsq(real / scale, np.concatenate([target.real, target.imag]), rcond=1e-10)[0] / scale
    return np.asarray(misfit - free @ state)
