"""Mean spectrum and standard error of each periodic segment, corrected for the command's content on silent lines."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from analysis.diagnosis.data.spectral_lines import DetectionLines, find_driven_inputs
from analysis.diagnosis.noise.channel_noise import ChannelNoise
from analysis.diagnosis.noise.periods import Periods, period_spectra
from equalizer.identification.frequency_response.experiments import instrument_signal
from equalizer.identification.frequency_response.noise_floor import period_variance, smooth_over_lines
from equalizer.signals.recording import Recording
from equalizer.signals.signal import ComplexArray, FloatArray, Signal

_SMOOTHED_LINES = 9
"""Lines over which the spread between periods is averaged."""
_CLEAN = 1e-5
"""Share of a command's strongest line below which its content on a silent line is negligible."""
_LEAST_INDEPENDENCE = 1e-3
"""Least ratio of the smallest to the largest singular value of the inputs for which a line determines a response."""
_INTERPOLATED = 0.1
"""Relative error of a response that is interpolated between driven lines."""


@dataclass(frozen=True, slots=True, eq=False)
class SegmentSpectrum:
    """Mean spectrum of one signal in one segment, with its errors. Arrays are (lines, channels)."""

    input: str
    """Driven inputs, joined by "+"."""
    amplitude: float
    lines: DetectionLines
    frequency_hz: FloatArray
    mean: ComplexArray
    """Mean over the periods; on silent lines without the command's own contribution."""
    error: FloatArray
    """Expected |error|² of the mean."""
    spread: FloatArray
    """|error|² of one period, from the differences between periods; the floor's where there is one period."""
    floor: FloatArray
    """|error|² of one period from noise alone."""
    count: int
    floor_freedom: FloatArray
    """(channels,)"""


def segment_spectra(
    recording: Recording,
    signal: Signal,
    noise: ChannelNoise,
    floor_hz: FloatArray,
    periods: Sequence[tuple[Periods, DetectionLines]],
) -> list[SegmentSpectrum]:
    """One spectrum per periodic segment. noise: of the signal, on the lines floor_hz."""
    spectra = []
    for length in dict.fromkeys(period.length for period, _ in periods):
        equal_periods = [(period, lines) for period, lines in periods if period.length == length]
        commands = [period_spectra(recording.command.samples, period).mean(axis=0) for period, _ in equal_periods]
        responses = [period_spectra(signal.samples, period) for period, _ in equal_periods]
        driven = [
            np.where(lines.driven[:, None], excitation, 0)
            for (_, lines), excitation in zip(equal_periods, commands, strict=True)
        ]
        linear_response = _linear_response(driven, commands, responses)
        lines_hz = equal_periods[0][0].frequency_hz(recording.sample_rate_hz)
        floor = _noise_on_lines(noise, floor_hz, lines_hz) / length
        for (period, lines), command, response in zip(equal_periods, commands, responses, strict=True):
            mean, error, spread = _mean_and_errors(response, floor, noise.rounding / length)
            if linear_response is not None:
                contribution, contribution_error = command_contribution(
                    linear_response, np.where(lines.driven[:, None], 0, command)
                )
                mean, error = mean - contribution, error + contribution_error
            spectrum = (lines, lines_hz, mean, error, spread, floor, period.count, noise.freedom)
            spectra.append(SegmentSpectrum(inputs_of(recording, period), period.segment.amplitude, *spectrum))
    return spectra


def inputs_of(recording: Recording, periods: Periods) -> str:
    """Names of the inputs that are driven in the first of the periods, joined by "+"."""
    first_period = slice(periods.starts[0], periods.starts[0] + periods.length)
    return "+".join(
        find_driven_inputs(instrument_signal(recording)[first_period].var(axis=0), recording.command.channels)
    )


def _noise_on_lines(noise: ChannelNoise, floor_hz: FloatArray, lines_hz: FloatArray) -> FloatArray:
    """Noise density of the differences between periods: the noise without the repeating part of rounding."""
    return np.stack([np.interp(lines_hz, floor_hz, channel) for channel in noise.density.T], axis=1) - noise.rounding


def _mean_and_errors(
    response: ComplexArray, floor: FloatArray, rounding: FloatArray
) -> tuple[ComplexArray, FloatArray, FloatArray]:
    count = len(response)
    spread = period_variance(response) if count > 1 else floor
    smoothed_spread = np.maximum(floor, smooth_over_lines(spread, _SMOOTHED_LINES))
    return response.mean(axis=0), smoothed_spread / count + rounding, spread


def _linear_response(
    driven: Sequence[ComplexArray], commands: Sequence[ComplexArray], responses: Sequence[ComplexArray]
) -> ComplexArray | None:
    """The linear frequency response at all lines; None where the commands are zero on silent lines."""
    clean = all(
        np.abs(command - driven_lines).max(initial=0.0) <= _CLEAN * np.abs(command).max(initial=0.0)
        for driven_lines, command in zip(driven, commands, strict=True)
    )
    return (
        None
        if clean
        else interpolate_response(line_responses(driven, [response.mean(axis=0) for response in responses]))
    )


def line_responses(commands: Sequence[ComplexArray], responses: Sequence[ComplexArray]) -> ComplexArray:
    """(lines, outputs, inputs): the linear response at lines where the experiments drive every direction; NaN
    elsewhere. commands: each (lines, inputs), zero where not driven; responses: each (lines, outputs). With it the part
    of the response is subtracted that the command causes on silent lines: under feedback distortion returns through the
    command."""
    inputs, outputs = np.stack(commands, axis=1), np.stack(responses, axis=1)
    size = np.linalg.svd(inputs, compute_uv=False)
    usable = (inputs.shape[1] >= inputs.shape[2]) & (size[:, -1] > _LEAST_INDEPENDENCE * size[:, 0])
    transfer = np.full((len(inputs), outputs.shape[2], inputs.shape[2]), np.nan + 0j)
    if usable.any():
        solutions = np.linalg.pinv(inputs[usable]) @ outputs[usable]
        transfer[usable] = np.swapaxes(solutions, 1, 2)
    return transfer


def interpolate_response(response: ComplexArray) -> ComplexArray | None:
    """The response at all lines, interpolated between known ones; None with fewer than two. response: (lines, ...)"""
    known_lines = np.flatnonzero(np.isfinite(response).all(axis=(1, 2)))
    if len(known_lines) < 2:
        return None
    lines = np.arange(len(response))
    flat = response.reshape(len(response), -1)
    real = [np.interp(lines, known_lines, column) for column in flat[known_lines].real.T]
    imaginary = [np.interp(lines, known_lines, column) for column in flat[known_lines].imag.T]
    return np.asarray((np.array(real) + 1j * np.array(imaginary)).T.reshape(response.shape), dtype=np.complex128)


def command_contribution(response: ComplexArray, command: ComplexArray) -> tuple[ComplexArray, FloatArray]:
    """Linear response to the command's lines, and the variance of its error: both (lines, outputs)."""
    contribution = np.einsum("lij,lj->li", response, command)
    return contribution, _INTERPOLATED**2 * np.abs(contribution) ** 2
