"""Spectra of the residual (recording minus prediction) and of its noise, from which the entry point of a missing effect
is found (`entry_point`).

Channels are those of the response, then of the position. A spectrum is that of the mean period (rfft / n, see
`compute_line_spectra`), on the lines from the first to the last that the excitation drives.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from analysis.diagnosis.data.spectral_lines import compute_hold_samples, find_detection_lines
from analysis.diagnosis.localisation.mismatch_cells import Prediction
from analysis.diagnosis.noise.channel_noise import ChannelNoise
from analysis.diagnosis.noise.noise_floor import NoiseFloor
from analysis.diagnosis.noise.periods import Periods, compute_period_spectra, find_settled_periods
from analysis.diagnosis.types import Mask
from equalizer.identification.frequency_response.experiments import select_instrument_signal
from equalizer.signals.recording import Recording, Segment, list_segments
from equalizer.signals.signal import ComplexArray, FloatArray

_WINDOW_S = 2.0
"""Length (s) of a window of a recording that has no period. Chosen by hand."""
_LEAST_AMPLITUDE_SHARE = 0.1
"""Least amplitude of a channel in the model error, relative to the strongest channel of the same signal. Chosen by
hand."""


@dataclass(frozen=True, slots=True, eq=False)
class ResidualSpectra:
    """Residual spectra of several experiments (periodic segments, or windows) on the same lines."""

    frequency_hz: FloatArray
    """(lines,), within the driven band"""
    residual: ComplexArray
    """(experiments, lines, channels)"""
    noise: FloatArray
    """(experiments, lines, channels): expected |error|² of the residual, by noise and by model error."""
    responses: int
    """Number of response channels."""


def compute_residual_spectra(
    recording: Recording,
    prediction: Prediction,
    floor: NoiseFloor,
    used: Mask | None = None,
    model_error: float = 0.01,
) -> ResidualSpectra | None:
    """Compute the spectrum of each excerpt: the mean period of a segment, or a window of `_WINDOW_S` where nothing is
    periodic. None where neither can be cut from usable samples, the noise is not known, or no line is driven. used:
    (n,), usable samples; None = all. Segments whose period differs from that of the first are left out. model_error:
    relative to the response (default chosen by hand); it counts as noise, because residuals on other axes might else
    appear as a second force."""
    residuals = [recording.response.samples - prediction.response]
    channel_noises = [floor.response]
    if recording.position is not None and prediction.position is not None and floor.position is not None:
        residuals.append(recording.position.samples - prediction.position)
        channel_noises.append(floor.position)
    residual = np.hstack(residuals)
    is_usable = np.isfinite(residual).all(axis=1) & (np.ones(len(residual), dtype=np.bool_) if used is None else used)
    usable_periods = (_select_usable_periods(periods, is_usable) for periods in find_settled_periods(recording))
    excerpts = [periods for periods in usable_periods if periods.starts]
    if not excerpts:
        excerpts = _cut_windows(recording, is_usable)
    excerpts = [excerpt for excerpt in excerpts if excerpt.length == excerpts[0].length]
    if not excerpts or not floor.is_known:
        return None
    lines_hz = excerpts[0].compute_line_frequencies(recording.sample_rate_hz)
    excitation = np.stack(
        [compute_period_spectra(select_instrument_signal(recording), excerpt).mean(axis=0) for excerpt in excerpts]
    )
    total_excitation = np.sqrt(np.sum(np.abs(excitation) ** 2, axis=0)).astype(np.complex128)
    detection_lines = find_detection_lines(total_excitation, compute_hold_samples(select_instrument_signal(recording)))
    if detection_lines is None:
        return None
    first_line, last_line = np.flatnonzero(detection_lines.driven)[[0, -1]]
    driven_lines = slice(int(first_line), int(last_line) + 1)
    spectra = np.stack([compute_period_spectra(residual, excerpt).mean(axis=0)[driven_lines] for excerpt in excerpts])
    driven_hz = lines_hz[driven_lines]
    noise = np.stack(
        [_compute_noise_power(channel_noises, floor.frequency_hz, driven_hz, excerpt) for excerpt in excerpts]
    )
    noise += model_error**2 * np.stack(
        [_compute_response_power(recording, excerpt, len(channel_noises) > 1)[driven_lines] for excerpt in excerpts]
    )
    return ResidualSpectra(driven_hz, spectra, noise, residuals[0].shape[1])


def _select_usable_periods(periods: Periods, is_usable: Mask) -> Periods:
    """Select the periods whose samples are all usable; `starts` may then be empty."""
    starts = tuple(start for start in periods.starts if is_usable[start : start + periods.length].all())
    return Periods(periods.index, periods.segment, starts, periods.settled)


def _cut_windows(recording: Recording, is_usable: Mask) -> list[Periods]:
    """Cut windows of `_WINDOW_S` from a recording without periods, each as a single period; segments of rest are left
    out."""
    length = min(round(_WINDOW_S * recording.sample_rate_hz), len(recording))
    windows = []
    for index, segment in enumerate(list_segments(recording)):
        for start in range(segment.start, segment.stop - length + 1, length):
            if segment.kind != "rest" and is_usable[start : start + length].all():
                window = Segment(start, start + length, segment.kind, segment.amplitude, length, segment.role)
                windows.append(Periods(index, window, (start,), True))
    return windows


def _compute_response_power(recording: Recording, periods: Periods, has_position: bool) -> FloatArray:
    """Compute (lines, channels): squared magnitude of the mean period of response (and position); a weak channel counts
    with the amplitude `_LEAST_AMPLITUDE_SHARE` of the strongest channel of its signal."""
    signals = [recording.response, *([recording.position] if has_position and recording.position is not None else [])]
    channel_powers = []
    for signal in signals:
        power = np.abs(compute_period_spectra(signal.samples, periods).mean(axis=0)) ** 2
        channel_powers.append(np.maximum(power, _LEAST_AMPLITUDE_SHARE**2 * power.max(axis=1, keepdims=True)))
    return np.hstack(channel_powers)


def _compute_noise_power(
    channel_noises: Sequence[ChannelNoise], floor_hz: FloatArray, lines_hz: FloatArray, periods: Periods
) -> FloatArray:
    """Compute (lines, channels): expected power of the noise in the mean period. Averaging over `periods.count` periods
    does not lower the rounding errors, which repeat with the motion."""
    noise_powers = []
    for noise in channel_noises:
        density = np.stack([np.interp(lines_hz, floor_hz, channel) for channel in noise.density.T], axis=1)
        noise_powers.append(((density - noise.rounding) / periods.count + noise.rounding) / periods.length)
    return np.hstack(noise_powers)
