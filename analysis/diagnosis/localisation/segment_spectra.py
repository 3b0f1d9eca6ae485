"""Compute the mean spectrum of each periodic segment and its variance, corrected for the command on silent lines.

Silent lines are those that the excitation does not drive, where nonlinear distortion appears (`distortion`). With
feedback, distortion of the response also appears in the command: the linear response to the command's silent lines is
estimated from the driven lines (H1 estimate) and subtracted, unless it is negligible or not determined. Spectra are
those of `periods.compute_period_spectra` (DFT divided by the length of the period).
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
"""Number of lines over which the variance between periods is averaged. Chosen."""
_NEGLIGIBLE_SHARE = 1e-5
"""Share of a command's strongest line up to which its content on silent lines is negligible. Chosen."""
_LEAST_SINGULAR_VALUE_RATIO = 1e-3
"""Ratio of the smallest to the largest singular value of the inputs above which a line determines a response.
Chosen."""
_RELATIVE_INTERPOLATION_ERROR = 0.1
"""Relative error (rms) of a response that is interpolated between driven lines. Chosen."""


@dataclass(frozen=True, slots=True, eq=False)
class SegmentSpectrum:
    """Mean spectrum of one signal in one segment, with its error variances. Arrays are (lines, channels); spectra are
    in the signal's unit, variances in its square."""

    input: str
    """Driven inputs, joined by "+"."""
    amplitude: float
    """Level of the segment's excitation, in the command's unit."""
    lines: DetectionLines
    """Driven and silent lines."""
    frequency_hz: FloatArray
    """(lines,)"""
    mean: ComplexArray
    """Mean over the periods, less the response to the command's silent lines where it is estimated."""
    mean_variance: FloatArray
    """Variance of the mean in squared units of the channel, that of the subtracted response included."""
    period_variance: FloatArray
    """Variance of one period, from the differences between periods; equal to `noise_variance` with one period."""
    noise_variance: FloatArray
    """Variance of one period from noise alone, without the rounding that repeats in every period."""
    count: int
    """Number of periods."""
    noise_freedom: FloatArray
    """(channels,): degrees of freedom of `noise_variance`; 0 where unknown."""


def compute_segment_spectra(
    recording: Recording,
    signal: Signal,
    noise: ChannelNoise,
    noise_hz: FloatArray,
    periods: Sequence[tuple[Periods, DetectionLines]],
) -> list[SegmentSpectrum]:
    """Compute the spectrum of each periodic segment, ordered by the first occurrence of its length of period; segments
    with equal length share one estimate of the linear response. noise: of the signal; noise_hz: (lines,), frequencies
    of its density; periods: with their driven and silent lines."""
    spectra = []
    for length in dict.fromkeys(period.length for period, _ in periods):
        equal_periods = [(period, lines) for period, lines in periods if period.length == length]
        commands = [
            compute_period_spectra(recording.command.samples, period).mean(axis=0) for period, _ in equal_periods
        ]
        responses = [compute_period_spectra(signal.samples, period) for period, _ in equal_periods]
        driven_commands = [
            np.where(lines.driven[:, None], excitation, 0)
            for (_, lines), excitation in zip(equal_periods, commands, strict=True)
        ]
        linear_response = _estimate_linear_response(driven_commands, commands, responses)
        lines_hz = equal_periods[0][0].compute_line_frequencies(recording.sample_rate_hz)
        noise_variance = _interpolate_noise(noise, noise_hz, lines_hz) / length
        for (period, lines), command, response in zip(equal_periods, commands, responses, strict=True):
            mean, mean_variance, period_variance = _estimate_mean(response, noise_variance, noise.rounding / length)
            if linear_response is not None:
                contribution, contribution_variance = compute_command_contribution(
                    linear_response, np.where(lines.driven[:, None], 0, command)
                )
                mean, mean_variance = mean - contribution, mean_variance + contribution_variance
            args = (lines, lines_hz, mean, mean_variance, period_variance, noise_variance, period.count, noise.freedom)
            spectra.append(SegmentSpectrum(join_driven_input_names(recording, period), period.segment.amplitude, *args))
    return spectra


def join_driven_input_names(recording: Recording, periods: Periods) -> str:
    """Join the names of the inputs that are driven in the first of the periods by "+"."""
    first_period = slice(periods.starts[0], periods.starts[0] + periods.length)
    return "+".join(
        find_driven_inputs(select_instrument_signal(recording)[first_period].var(axis=0), recording.command.channels)
    )


def _interpolate_noise(noise: ChannelNoise, noise_hz: FloatArray, lines_hz: FloatArray) -> FloatArray:
    """Interpolate the noise density to the frequencies `lines_hz`, (lines, channels), without the part of rounding that
    repeats in every period. noise_hz: frequencies of the density."""
    return np.stack([np.interp(lines_hz, noise_hz, channel) for channel in noise.density.T], axis=1) - noise.rounding


def _estimate_mean(
    response: ComplexArray, noise_variance: FloatArray, rounding: FloatArray
) -> tuple[ComplexArray, FloatArray, FloatArray]:
    """Estimate the mean over periods, the variance of the mean, and that of one period (not smoothed); each (lines,
    channels). response: (periods, lines, channels). noise_variance: that of one period, the lower limit of the smoothed
    variance. rounding: (channels,), variance of the rounding error that repeats in every period."""
    period_count = len(response)
    period_variance = compute_period_variance(response) if period_count > 1 else noise_variance
    smoothed_variance = np.maximum(noise_variance, smooth_over_lines(period_variance, _SMOOTHED_LINES))
    return response.mean(axis=0), smoothed_variance / period_count + rounding, period_variance


def _estimate_linear_response(
    driven_commands: Sequence[ComplexArray], commands: Sequence[ComplexArray], responses: Sequence[ComplexArray]
) -> ComplexArray | None:
    """Estimate the linear frequency response at all lines, (lines, outputs, inputs); None where the commands are
    negligible on silent lines (`_NEGLIGIBLE_SHARE`), or fewer than two lines determine it. driven_commands: commands
    set to zero on silent lines; responses: (periods, lines, outputs) per segment."""
    is_negligible = all(
        np.abs(command - driven_command).max(initial=0.0) <= _NEGLIGIBLE_SHARE * np.abs(command).max(initial=0.0)
        for driven_command, command in zip(driven_commands, commands, strict=True)
    )
    return (
        None
        if is_negligible
        else interpolate_response(
            estimate_line_responses(driven_commands, [response.mean(axis=0) for response in responses])
        )
    )


def estimate_line_responses(commands: Sequence[ComplexArray], responses: Sequence[ComplexArray]) -> ComplexArray:
    """Estimate the frequency response (lines, outputs, inputs) by least squares over experiments (H1), at lines where
    these excite all input directions; NaN elsewhere. commands: each (lines, inputs), zero where not driven; responses:
    each (lines, outputs)."""
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
    """Interpolate the response linearly between known lines, constant beyond them; None with fewer than two known
    lines. response: (lines, outputs, inputs), NaN where not known."""
    known_lines = np.flatnonzero(np.isfinite(response).all(axis=(1, 2)))
    if len(known_lines) < 2:
        return None
    lines = np.arange(len(response))
    flat_response = response.reshape(len(response), -1)
    real = [np.interp(lines, known_lines, column) for column in flat_response[known_lines].real.T]
    imaginary = [np.interp(lines, known_lines, column) for column in flat_response[known_lines].imag.T]
    return np.asarray((np.array(real) + 1j * np.array(imaginary)).T.reshape(response.shape), dtype=np.complex128)


def compute_command_contribution(response: ComplexArray, command: ComplexArray) -> tuple[ComplexArray, FloatArray]:
    """Compute the linear response to the command's lines, and the variance of its error from interpolation: both
    (lines, outputs). response: (lines, outputs, inputs); command: (lines, inputs)."""
    contribution = np.einsum("lij,lj->li", response, command)
    return contribution, _RELATIVE_INTERPOLATION_ERROR**2 * np.abs(contribution) ** 2
