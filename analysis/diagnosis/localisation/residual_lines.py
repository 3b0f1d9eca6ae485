"""Power spectrum of the residual, by segment and octave.

Where periods repeat: the spectrum of their mean, whose lines are independent. Elsewhere: Hann windows that overlap by
half (Welch 1967); their correlation reduces the degrees of freedom. Powers are mean squares in the signal's unit
squared, one-sided: twice the squared magnitudes of the lines of positive frequency.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from analysis.diagnosis.data.spectral_lines import (
    Band,
    detection_lines,
    find_driven_inputs,
    hold_length,
    lines_in_band,
    octaves_between,
)
from analysis.diagnosis.noise.channel_noise import ChannelNoise
from analysis.diagnosis.noise.periods import Periods, find_settled_periods, mean_spectrum
from analysis.diagnosis.types import Mask
from equalizer.identification.frequency_response.experiments import instrument_signal
from equalizer.signals.recording import Recording, Segment
from equalizer.signals.signal import FloatArray
from equalizer.signals.spectral_density import hann, line_spectra

_WINDOW_S = 1.0
"""Length of a window where nothing is periodic (s). By hand."""
_DRIVEN_IN_BAND = 1e-4
"""Share of the strongest band's power of the command below which a band is not driven. By hand."""
_DRIVEN_IN_WINDOW = 1e-2
"""Share of its band's strongest window below which a window does not count for the band. By hand."""
_HANN_NEIGHBOURS = 1.944
"""1 + 2 (4/9 + 1/36): factor by which the correlation of neighbouring lines of a Hann window, 2/3 and 1/6, reduces the
degrees of freedom."""
_HANN_OVERLAP = 1.056
"""1 + 2/36: the same for windows that overlap by half, whose correlation is 1/6."""
_LEAST_AMPLITUDE = 0.1
"""Least amplitude of a channel, relative to the strongest of its quantity, by hand: the response of a channel that is
hardly driven depends on fractions of a degree of misalignment, so the strongest is the reference."""


@dataclass(frozen=True, slots=True, eq=False)
class ResidualLines:
    """Powers of one signal in one band of one segment; each array (channels,)."""

    input: str
    amplitude: float
    band_hz: Band
    seconds: float
    """Duration of the data."""
    lines: float
    """Number of independent lines."""
    residual: FloatArray
    """Mean square of the residual, summed over lines, noise included."""
    noise: FloatArray
    """The same expected from noise alone."""
    signal: FloatArray
    """Mean square of the response without its noise."""
    whitened: FloatArray
    """Mean over lines of residual power / noise power: 1 for noise alone."""
    signal_to_noise: FloatArray
    """Signal over noise power, summed over independent lines; weak channels count with a tenth of the strongest
    channel's amplitude."""


@dataclass(frozen=True, slots=True, eq=False)
class Observation:
    """One signal with its prediction; each (n, channels)."""

    measured: FloatArray
    predicted: FloatArray
    noise: ChannelNoise
    noise_hz: FloatArray
    """Frequencies of the noise's spectral density (Hz)."""
    quantities: tuple[str, ...]


def residual_lines(recording: Recording, observation: Observation, used: Mask) -> list[ResidualLines]:
    """Residual power by segment and band. used: (n,), the samples that count. Segments without a complete period or
    window are left out."""
    usable = used & np.isfinite(observation.measured).all(axis=1) & np.isfinite(observation.predicted).all(axis=1)
    periods = {period.index: period for period in find_settled_periods(recording)}
    residual = observation.measured - observation.predicted
    lines: list[ResidualLines] = []
    for index, segment in enumerate(recording.segments or (Segment(0, len(recording), "noise", 0.0),)):
        if segment.kind == "rest":
            continue
        if index in periods:
            starts = tuple(s for s in periods[index].starts if usable[s : s + segment.period].all())
            if starts:
                lines += _lines_of_periods(
                    recording, observation, residual, Periods(index, segment, starts, periods[index].settled)
                )
        else:
            lines += _lines_of_windows(recording, observation, residual, (segment, usable))
    return lines


def _lines_of_periods(
    recording: Recording, observation: Observation, residual: FloatArray, periods: Periods
) -> list[ResidualLines]:
    """Residual power of the mean period, by octave. residual: (n, channels)."""
    excitation = mean_spectrum(instrument_signal(recording), periods)
    driven = detection_lines(excitation, hold_length(instrument_signal(recording)))
    if driven is None:
        return []
    lines_hz = periods.frequency_hz(recording.sample_rate_hz)
    response = np.abs(mean_spectrum(observation.measured, periods)) ** 2
    residual_power = np.abs(mean_spectrum(residual, periods)) ** 2
    noise = _noise_power(observation, lines_hz, periods.count) / periods.length
    inputs = "+".join(find_driven_inputs(np.sum(np.abs(excitation) ** 2, axis=0), recording.command.channels))
    lowest, highest = (float(line) for line in lines_hz[driven.driven][[0, -1]])
    in_driven_band = (lines_hz >= lowest) & (lines_hz <= highest)
    seconds = periods.count * periods.length / recording.sample_rate_hz
    octave_lines = []
    for band in octaves_between(lowest, highest):
        in_octave = in_driven_band & lines_in_band(lines_hz, band)
        if (in_octave & driven.driven).any():
            cell = (inputs, periods.segment.amplitude, band, seconds, float(in_octave.sum()))
            octave_lines.append(
                _sum_lines(
                    cell, residual_power[in_octave], noise[in_octave], response[in_octave], observation.quantities
                )
            )
    return octave_lines


def _lines_of_windows(
    recording: Recording, observation: Observation, residual: FloatArray, segment_and_mask: tuple[Segment, Mask]
) -> list[ResidualLines]:
    """Residual power of Hann windows, by octave. residual: (n, channels). segment_and_mask: the segment, and the mask
    (n,) of samples that count."""
    segment, usable = segment_and_mask
    length = min(round(_WINDOW_S * recording.sample_rate_hz), segment.stop - segment.start)
    starts = [
        s for s in range(segment.start, segment.stop - length + 1, max(length // 2, 1)) if usable[s : s + length].all()
    ]
    command = instrument_signal(recording)[segment.start : segment.stop]
    if length < 16 or not starts or not np.isfinite(command).all():
        return []
    lines_hz: FloatArray = np.arange(1.0, (length + 1) // 2) * (recording.sample_rate_hz / length)
    excitation = np.sum(_window_power(instrument_signal(recording), starts, length), axis=2)
    response = _window_power(observation.measured, starts, length)
    residual_power = _window_power(residual, starts, length)
    noise = np.broadcast_to(_noise_power(observation, lines_hz, 1) / length, response.shape)
    inputs = "+".join(find_driven_inputs(command.var(axis=0), recording.command.channels))
    by_band = [
        (band, lines_in_band(lines_hz, band)) for band in octaves_between(2 * float(lines_hz[0]), float(lines_hz[-1]))
    ]
    strongest = max(float(excitation[:, lines].sum(axis=1).max(initial=0.0)) for _, lines in by_band)
    octave_lines = []
    for band, lines in by_band:
        power = excitation[:, lines].sum(axis=1)
        if not lines.any() or power.max() <= _DRIVEN_IN_BAND * strongest:
            continue
        driven_lines = np.ix_(power > _DRIVEN_IN_WINDOW * power.max(), lines)
        windows, width = len(driven_lines[0]), int(lines.sum())
        independent = windows * width / (_HANN_NEIGHBOURS * (_HANN_OVERLAP if windows > 1 else 1.0))
        cell = (
            inputs,
            segment.amplitude,
            band,
            windows * length / 2 / recording.sample_rate_hz,
            max(independent, 1.0),
        )
        powers = [power_of[driven_lines].reshape(windows * width, -1) for power_of in (residual_power, noise, response)]
        per_window = _sum_lines(cell, powers[0], powers[1], powers[2], observation.quantities)
        octave_lines.append(_per_window(per_window, windows))
    return octave_lines


def _window_power(samples: FloatArray, starts: Sequence[int], length: int) -> FloatArray:
    """Squared magnitudes (windows, lines, channels) of windows without their mean, times a Hann window of unit
    power."""
    window = np.sqrt(8 / 3) * hann(length)
    periods = np.stack([samples[start : start + length] for start in starts])
    return np.abs(line_spectra((periods - periods.mean(axis=1, keepdims=True)) * window[:, None])) ** 2


def _noise_power(observation: Observation, lines_hz: FloatArray, periods: int) -> FloatArray:
    """(lines, channels): noise power of a line times the length, for a mean of `periods` periods. The part of rounding
    that repeats in every period does not average out."""
    density = np.stack(
        [np.interp(lines_hz, observation.noise_hz, channel) for channel in observation.noise.density.T], axis=1
    )
    return (density - observation.noise.rounding) / periods + observation.noise.rounding


def _sum_lines(
    cell: tuple[str, float, Band, float, float],
    residual: FloatArray,
    noise: FloatArray,
    response: FloatArray,
    quantities: tuple[str, ...],
) -> ResidualLines:
    """The powers summed over lines. cell: input, amplitude, band (Hz), duration (s) and number of independent lines.
    residual, noise, response: (lines, channels), squared magnitudes of the lines of positive frequency."""
    signal = np.maximum(response - noise, 0.0)
    strongest = np.stack(
        [
            signal[:, [other_quantity == quantity for other_quantity in quantities]].max(axis=1)
            for quantity in quantities
        ],
        axis=1,
    )
    raised = np.maximum(signal, _LEAST_AMPLITUDE**2 * strongest)
    positive_noise = np.maximum(noise, np.finfo(np.float64).tiny)
    lines = cell[4]
    return ResidualLines(
        *cell,
        2 * residual.sum(axis=0),
        2 * noise.sum(axis=0),
        2 * raised.sum(axis=0),
        np.mean(residual / positive_noise, axis=0),
        lines * np.mean(raised / positive_noise, axis=0),
    )


def _per_window(summed: ResidualLines, windows: int) -> ResidualLines:
    """The sums over all windows divided by their number: mean squares of a window."""
    return ResidualLines(
        summed.input, summed.amplitude, summed.band_hz, summed.seconds, summed.lines,
        summed.residual / windows, summed.noise / windows, summed.signal / windows,
        summed.whitened, summed.signal_to_noise,
    )  # fmt: skip
