"""Compute the power of the residual, the noise and the signal by segment and octave.

In segments with a usable period, the spectrum is that of the mean period, whose lines are independent. In all others,
it is the mean over Hann windows that overlap by half (Welch, IEEE Trans. Audio Electroacoust. 15:70, 1967), whose
correlation reduces the degrees of freedom. Powers are mean squares in the signal's unit squared, one-sided: twice the
squared magnitudes of the lines of positive frequency.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from analysis.diagnosis.data.spectral_lines import (
    Band,
    compute_hold_samples,
    find_detection_lines,
    find_driven_inputs,
    list_octaves,
    select_lines_in_band,
)
from analysis.diagnosis.noise.channel_noise import ChannelNoise
from analysis.diagnosis.noise.periods import Periods, compute_mean_spectrum, find_settled_periods
from analysis.diagnosis.types import Mask
from equalizer.identification.frequency_response.experiments import select_instrument_signal
from equalizer.signals.recording import Recording, Segment, list_segments
from equalizer.signals.signal import FloatArray
from equalizer.signals.spectral_density import compute_line_spectra, hann

_WINDOW_S = 1.0
"""Longest window (s) in segments without a period. By hand."""
_DRIVEN_BAND_SHARE = 1e-4
"""Share of the strongest band's power of the command up to which a band is not driven. By hand."""
_DRIVEN_WINDOW_SHARE = 1e-2
"""Share of the power of its band's strongest window up to which a window is left out of the band. By hand."""
_HANN_NEIGHBOUR_FACTOR = 1.944
"""1 + 2 (4/9 + 1/36): factor by which the correlations 2/3 and 1/6 of a Hann window's line with the next two lines
reduce the degrees of freedom."""
_HANN_OVERLAP_FACTOR = 1.056
"""1 + 2/36: the same for consecutive windows that overlap by half, whose correlation is 1/6."""
_LEAST_AMPLITUDE_SHARE = 0.1
"""Lower limit of a channel's amplitude, relative to the strongest channel of its quantity. By hand: the response of a
channel that is hardly driven depends on fractions of a degree of misalignment."""


@dataclass(frozen=True, slots=True, eq=False)
class ResidualLines:
    """Powers of one signal in one band of one segment; each array (channels,)."""

    input: str
    """Driven inputs, joined by "+"."""
    amplitude: float
    """Level of the segment's excitation, in the command's unit."""
    band_hz: Band
    """Lower and upper end (Hz); an octave."""
    seconds: float
    """Duration (s) of the data."""
    lines: float
    """Number of independent lines, at least 1."""
    residual: FloatArray
    """Mean square of the residual, summed over lines, noise included."""
    noise: FloatArray
    """Mean square of the residual that is expected from noise alone."""
    signal: FloatArray
    """Mean square of the response less its noise, weak channels raised to `_LEAST_AMPLITUDE_SHARE`."""
    whitened: FloatArray
    """Mean over lines of residual power / noise power: 1 for noise alone."""
    signal_to_noise: FloatArray
    """Ratio of signal to noise power, summed over independent lines."""


@dataclass(frozen=True, slots=True, eq=False)
class Observation:
    """One measured signal with its prediction and noise."""

    measured: FloatArray
    """(n, channels)"""
    predicted: FloatArray
    """(n, channels)"""
    noise: ChannelNoise
    """Noise of the measured signal."""
    noise_hz: FloatArray
    """(lines,): frequencies of the noise's spectral density (Hz)."""
    quantities: tuple[str, ...]
    """Quantity of each channel."""


def compute_residual_lines(recording: Recording, observation: Observation, used: Mask) -> list[ResidualLines]:
    """Compute the residual power by segment and octave. used: (n,), mask of the samples to use. Segments of rest, and
    those without a driven line or a complete period or window of used, finite samples, are left out; a recording
    without segments counts as one segment."""
    is_usable = used & np.isfinite(observation.measured).all(axis=1) & np.isfinite(observation.predicted).all(axis=1)
    settled_periods = {period.index: period for period in find_settled_periods(recording)}
    residual = observation.measured - observation.predicted
    octave_lines: list[ResidualLines] = []
    for segment_index, segment in enumerate(list_segments(recording)):
        if segment.kind == "rest":
            continue
        if segment_index in settled_periods:
            starts = tuple(
                start
                for start in settled_periods[segment_index].starts
                if is_usable[start : start + segment.period].all()
            )
            if starts:
                octave_lines += _sum_period_octaves(
                    recording,
                    observation,
                    residual,
                    Periods(segment_index, segment, starts, settled_periods[segment_index].settled),
                )
        else:
            octave_lines += _sum_window_octaves(recording, observation, residual, (segment, is_usable))
    return octave_lines


def _sum_period_octaves(
    recording: Recording, observation: Observation, residual: FloatArray, periods: Periods
) -> list[ResidualLines]:
    """Compute the residual power of the mean period, by octave of the driven band; empty where no line is driven.
    residual: (n, channels)."""
    excitation = compute_mean_spectrum(select_instrument_signal(recording), periods)
    detection_lines = find_detection_lines(excitation, compute_hold_samples(select_instrument_signal(recording)))
    if detection_lines is None:
        return []
    lines_hz = periods.compute_line_frequencies(recording.sample_rate_hz)
    response_power = np.abs(compute_mean_spectrum(observation.measured, periods)) ** 2
    residual_power = np.abs(compute_mean_spectrum(residual, periods)) ** 2
    noise_power = _compute_noise_power(observation, lines_hz, periods.count) / periods.length
    inputs = "+".join(find_driven_inputs(np.sum(np.abs(excitation) ** 2, axis=0), recording.command.channels))
    lowest_hz, highest_hz = (float(line) for line in lines_hz[detection_lines.driven][[0, -1]])
    is_in_driven_band = (lines_hz >= lowest_hz) & (lines_hz <= highest_hz)
    duration_s = periods.count * periods.length / recording.sample_rate_hz
    octave_lines = []
    for band in list_octaves(lowest_hz, highest_hz):
        is_in_octave = is_in_driven_band & select_lines_in_band(lines_hz, band)
        if (is_in_octave & detection_lines.driven).any():
            segment_properties = (inputs, periods.segment.amplitude, band, duration_s, float(is_in_octave.sum()))
            octave_lines.append(
                _sum_lines(
                    segment_properties,
                    residual_power[is_in_octave],
                    noise_power[is_in_octave],
                    response_power[is_in_octave],
                    observation.quantities,
                )
            )
    return octave_lines


def _sum_window_octaves(
    recording: Recording, observation: Observation, residual: FloatArray, segment_and_mask: tuple[Segment, Mask]
) -> list[ResidualLines]:
    """Compute the residual power of Hann windows, by octave of the driven band, from the second line on; empty where
    the window is shorter than 16 samples (chosen; it has too few lines), no window is usable, or a command is missing.
    residual: (n, channels). segment_and_mask: the segment, and the mask (n,) of usable samples."""
    segment, is_usable = segment_and_mask
    length = min(round(_WINDOW_S * recording.sample_rate_hz), segment.stop - segment.start)
    all_starts = range(segment.start, segment.stop - length + 1, max(length // 2, 1))
    starts = [start for start in all_starts if is_usable[start : start + length].all()]
    command = select_instrument_signal(recording)[segment.start : segment.stop]
    if length < 16 or not starts or not np.isfinite(command).all():
        return []
    lines_hz: FloatArray = np.arange(1.0, (length + 1) // 2) * (recording.sample_rate_hz / length)
    excitation_power = np.sum(_compute_window_power(select_instrument_signal(recording), starts, length), axis=2)
    response_power = _compute_window_power(observation.measured, starts, length)
    residual_power = _compute_window_power(residual, starts, length)
    noise_power = np.broadcast_to(_compute_noise_power(observation, lines_hz, 1) / length, response_power.shape)
    inputs = "+".join(find_driven_inputs(command.var(axis=0), recording.command.channels))
    octaves = list_octaves(2 * float(lines_hz[0]), float(lines_hz[-1]))
    octave_masks = [(octave, select_lines_in_band(lines_hz, octave)) for octave in octaves]
    strongest_power = max(
        float(excitation_power[:, is_in_band].sum(axis=1).max(initial=0.0)) for _, is_in_band in octave_masks
    )
    octave_lines = []
    for band, is_in_band in octave_masks:
        window_powers = excitation_power[:, is_in_band].sum(axis=1)
        if not is_in_band.any() or window_powers.max() <= _DRIVEN_BAND_SHARE * strongest_power:
            continue
        driven_lines = np.ix_(window_powers > _DRIVEN_WINDOW_SHARE * window_powers.max(), is_in_band)
        window_count, line_count = len(driven_lines[0]), int(is_in_band.sum())
        independent_lines = (
            window_count * line_count / (_HANN_NEIGHBOUR_FACTOR * (_HANN_OVERLAP_FACTOR if window_count > 1 else 1.0))
        )
        duration_s = window_count * length / 2 / recording.sample_rate_hz
        segment_properties = (inputs, segment.amplitude, band, duration_s, max(independent_lines, 1.0))
        powers = [
            line_power[driven_lines].reshape(window_count * line_count, -1)
            for line_power in (residual_power, noise_power, response_power)
        ]
        window_sum = _sum_lines(segment_properties, powers[0], powers[1], powers[2], observation.quantities)
        octave_lines.append(_divide_by_windows(window_sum, window_count))
    return octave_lines


def _compute_window_power(samples: FloatArray, starts: Sequence[int], length: int) -> FloatArray:
    """Compute the squared magnitudes (windows, lines, channels) of the spectra of windows without their mean, times a
    Hann taper of unit power. starts, length: of the windows, in samples."""
    taper = np.sqrt(8 / 3) * hann(length)
    windows = np.stack([samples[start : start + length] for start in starts])
    return np.abs(compute_line_spectra((windows - windows.mean(axis=1, keepdims=True)) * taper[:, None])) ** 2


def _compute_noise_power(observation: Observation, lines_hz: FloatArray, period_count: int) -> FloatArray:
    """Compute the noise power of a line times the length of a period, (lines, channels), for a mean over
    `period_count` periods. The part of the rounding error that repeats in every period does not average out."""
    density = np.stack(
        [np.interp(lines_hz, observation.noise_hz, channel) for channel in observation.noise.density.T], axis=1
    )
    return (density - observation.noise.rounding) / period_count + observation.noise.rounding


def _sum_lines(
    segment_properties: tuple[str, float, Band, float, float],
    residual: FloatArray,
    noise: FloatArray,
    response: FloatArray,
    quantities: tuple[str, ...],
) -> ResidualLines:
    """Sum the powers over lines. segment_properties: input, amplitude, band (Hz), duration (s) and number of
    independent lines. residual, noise, response: (lines, channels), squared magnitudes of the lines of positive
    frequency."""
    signal = np.maximum(response - noise, 0.0)
    strongest_signal = np.stack(
        [
            signal[:, [other_quantity == quantity for other_quantity in quantities]].max(axis=1)
            for quantity in quantities
        ],
        axis=1,
    )
    floored_signal = np.maximum(signal, _LEAST_AMPLITUDE_SHARE**2 * strongest_signal)
    numbers = np.finfo(np.float64)
    # A channel that is constant in the segment shows no noise at all, but no number is more exact than its rounding.
    least_noise = numbers.eps**2 * np.maximum(residual, floored_signal)
    positive_noise = np.maximum(np.maximum(noise, least_noise), numbers.tiny)
    line_count = segment_properties[4]
    return ResidualLines(
        *segment_properties,
        2 * residual.sum(axis=0),
        2 * noise.sum(axis=0),
        2 * floored_signal.sum(axis=0),
        np.mean(residual / positive_noise, axis=0),
        line_count * np.mean(floored_signal / positive_noise, axis=0),
    )


def _divide_by_windows(window_sum: ResidualLines, window_count: int) -> ResidualLines:
    """Divide the sums over all windows by their number, which gives the mean squares of a window. Ratios and line
    counts are kept."""
    return ResidualLines(
        window_sum.input, window_sum.amplitude, window_sum.band_hz, window_sum.seconds, window_sum.lines,
        window_sum.residual / window_count, window_sum.noise / window_count, window_sum.signal / window_count,
        window_sum.whitened, window_sum.signal_to_noise,
    )  # fmt: skip
