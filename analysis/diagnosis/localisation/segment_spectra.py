"""Mean spectrum of each periodic segment with its variance, corrected for the command's content on silent lines.

Silent lines are those that the excitation does not drive; `distortion`, which calls this module, finds nonlinear
distortion there. Under feedback distortion returns through the command: its linear response is subtracted.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from analysis.diagnosis.data.spectral_lines import DetectionLines, find_driven_inputs
from analysis.diagnosis.noise.channel_noise import ChannelNoise
from analysis.diagnosis.noise.periods import Periods, compute_period_spectra
from equalizer.identification.frequency_response.experiments import select_instrument_signal
from equalizer.identification.frequency_response.noise_floor import compute_period_variance, smooth_over_lines
from equalizer.signals.recording import Recording
from equalizer.signals.signal import ComplexArray, FloatArray, Signal

_SMOOTHED_LINES = 9
"""Lines over which the spread between periods is averaged."""
_NEGLIGIBLE_SHARE = 1e-5
"""Share of a command's strongest line below which its content on a silent line is negligible."""
_LEAST_SINGULAR_VALUE_RATIO = 1e-3
"""Least ratio of the smallest to the largest singular value of the inputs for which a line determines a response."""
_INTERPOLATION_ERROR = 0.1
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


def compute_segment_spectra(
    recording: Recording,
    signal: Signal,
    noise: ChannelNoise,
    floor_hz: FloatArray,
    periods: Sequence[tuple[Periods, DetectionLines]],
) -> list[SegmentSpectrum]:
    """Compute the spectrum of each periodic segment; segments of equal period share one estimate of the linear
    response. noise: of the signal, on the lines floor_hz."""
    spectra = []
    for length in dict.fromkeys(period.length for period, _ in periods):
        equal_periods = [(period, lines) for period, lines in periods if period.length == length]
        commands = [
            compute_period_spectra(recording.command.samples, period).mean(axis=0) for period, _ in equal_periods
        ]
        responses = [compute_period_spectra(signal.samples, period) for period, _ in equal_periods]
        driven = [
            np.where(lines.driven[:, None], excitation, 0)
            for (_, lines), excitation in zip(equal_periods, commands, strict=True)
        ]
        linear_response = _estimate_linear_response(driven, commands, responses)
        lines_hz = equal_periods[0][0].compute_line_frequencies(recording.sample_rate_hz)
        floor = _interpolate_noise(noise, floor_hz, lines_hz) / length
        for (period, lines), command, response in zip(equal_periods, commands, responses, strict=True):
            mean, error, spread = _estimate_mean(response, floor, noise.rounding / length)
            if linear_response is not None:
                contribution, contribution_error = compute_command_contribution(
                    linear_response, np.where(lines.driven[:, None], 0, command)
                )
                mean, error = mean - contribution, error + contribution_error
            spectrum_values = (lines, lines_hz, mean, error, spread, floor, period.count, noise.freedom)
            spectra.append(
                SegmentSpectrum(name_driven_inputs(recording, period), period.segment.amplitude, *spectrum_values)
            )
    return spectra


def name_driven_inputs(recording: Recording, periods: Periods) -> str:
    """Return the names of the inputs that are driven in the first of the periods, joined by "+"."""
    first_period = slice(periods.starts[0], periods.starts[0] + periods.length)
    return "+".join(
        find_driven_inputs(select_instrument_signal(recording)[first_period].var(axis=0), recording.command.channels)
    )


def _interpolate_noise(noise: ChannelNoise, floor_hz: FloatArray, lines_hz: FloatArray) -> FloatArray:
    """Interpolate the noise density to the lines, (lines, channels), without the part of rounding that repeats in every
    period: the density of the differences between periods. floor_hz: frequencies of the density."""
    return np.stack([np.interp(lines_hz, floor_hz, channel) for channel in noise.density.T], axis=1) - noise.rounding


def _estimate_mean(
    response: ComplexArray, floor: FloatArray, rounding: FloatArray
) -> tuple[ComplexArray, FloatArray, FloatArray]:
    """Estimate the mean over periods, the variance of the mean, and that of one period; each (lines, channels).
    response: (periods, lines, channels). floor: noise variance of one period, the lower limit. rounding:
    (channels,)."""
    count = len(response)
    spread = compute_period_variance(response) if count > 1 else floor
    smoothed_spread = np.maximum(floor, smooth_over_lines(spread, _SMOOTHED_LINES))
    return response.mean(axis=0), smoothed_spread / count + rounding, spread


def _estimate_linear_response(
    driven: Sequence[ComplexArray], commands: Sequence[ComplexArray], responses: Sequence[ComplexArray]
) -> ComplexArray | None:
    """Estimate the linear frequency response at all lines; None where the commands are negligible on silent lines
    (`_NEGLIGIBLE_SHARE`), or fewer than two lines determine it. driven: commands, zero on silent lines."""
    is_negligible = all(
        np.abs(command - driven_lines).max(initial=0.0) <= _NEGLIGIBLE_SHARE * np.abs(command).max(initial=0.0)
        for driven_lines, command in zip(driven, commands, strict=True)
    )
    return (
        None
        if is_negligible
        else interpolate_response(estimate_line_responses(driven, [response.mean(axis=0) for response in responses]))
    )


def estimate_line_responses(commands: Sequence[ComplexArray], responses: Sequence[ComplexArray]) -> ComplexArray:
    """(lines, outputs, inputs): the linear response by least squares over experiments (H1), at lines where these drive
    every direction; NaN elsewhere. commands: each (lines, inputs), zero where not driven; responses: each (lines,
    outputs). With it the part of the response is subtracted that the command causes on silent lines: under feedback
    distortion returns through the command."""
    inputs, outputs = np.stack(commands, axis=1), np.stack(responses, axis=1)
    singular_values = np.linalg.svd(inputs, compute_uv=False)
    is_determined = (inputs.shape[1] >= inputs.shape[2]) & (
        singular_values[:, -1] > _LEAST_SINGULAR_VALUE_RATIO * singular_values[:, 0]
    )
    transfer = np.full((len(inputs), outputs.shape[2], inputs.shape[2]), np.nan + 0j)
    if is_determined.any():
        solutions = np.linalg.pinv(inputs[is_determined]) @ outputs[is_determined]
        transfer[is_determined] = np.swapaxes(solutions, 1, 2)
    return transfer


def interpolate_response(response: ComplexArray) -> ComplexArray | None:
    """Interpolate the response linearly between known lines; None with fewer than two known lines. response: (lines,
    outputs, inputs), NaN where not known."""
    known_lines = np.flatnonzero(np.isfinite(response).all(axis=(1, 2)))
    if len(known_lines) < 2:
        return None
    lines = np.arange(len(response))
    flat_response = response.reshape(len(response), -1)
    real = [np.interp(lines, known_lines, column) for column in flat_response[known_lines].real.T]
    imaginary = [np.interp(lines, known_lines, column) for column in flat_response[known_lines].imag.T]
    return np.asarray((np.array(real) + 1j * np.array(imaginary)).T.reshape(response.shape), dtype=np.complex128)


def compute_command_contribution(response: ComplexArray, command: ComplexArray) -> tuple[ComplexArray, FloatArray]:
    """Compute the linear response to the command's lines, and the variance of its error: both (lines, outputs)."""
    contribution = np.einsum("lij,lj->li", response, command)
    return contribution, _INTERPOLATION_ERROR**2 * np.abs(contribution) ** 2
