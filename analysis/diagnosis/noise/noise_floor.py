"""Estimate the noise floor of a recording's response and position, by the first of three methods that the data allow:
differences between repeated periods, samples at rest, spectral lines above the driven band."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from analysis.diagnosis.noise.channel_noise import ChannelNoise
from analysis.diagnosis.noise.periods import Periods, find_settled_periods
from analysis.diagnosis.noise.quiet_noise import estimate_quiet_band_noise, estimate_rest_noise
from analysis.diagnosis.noise.repeat_noise import add_repeating_rounding, estimate_repeat_noise
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray, Signal

NoiseMethod = Literal["repeats", "rest", "quiet band", "unknown"]
_DEFAULT_LINE_COUNT = 511
"""Number of spectral lines below the Nyquist frequency, where no period determines them. Chosen."""


@dataclass(frozen=True, slots=True, eq=False)
class NoiseFloor:
    """Noise of a recording's response and position, and the method by which it was estimated."""

    method: NoiseMethod
    frequency_hz: FloatArray
    """(lines,): frequencies of the densities, Hz."""
    response: ChannelNoise
    position: ChannelNoise | None
    """None where the recording has no position."""
    remarks: tuple[str, ...]
    """Sentences on the method of the estimate, and on its weaknesses."""

    @property
    def response_rms(self) -> FloatArray:
        """Rms noise of the response (p,), in the channels' units; NaN where unknown."""
        return self.response.rms

    @property
    def position_rms(self) -> FloatArray | None:
        """Rms noise of the position (d,), in the channels' units; None without a position."""
        return None if self.position is None else self.position.rms

    @property
    def is_known(self) -> bool:
        """Whether the noise was estimated."""
        return self.method != "unknown"


def estimate_noise_floor(recording: Recording) -> NoiseFloor:
    """Estimate the noise from repeated periods; else at rest; else from the lines above the driven band, as white
    noise; else `method` is "unknown" and every rms NaN. A method at rest or above the band is used only if it is
    possible for the response and, where there is one, for the position."""
    periods = tuple(period for period in find_settled_periods(recording) if period.count > 1)
    if periods:
        return _estimate_from_repeats(recording, periods)
    sample_rate_hz = recording.sample_rate_hz
    lines_hz: FloatArray = np.arange(1.0, _DEFAULT_LINE_COUNT + 1) * (sample_rate_hz / 2 / (_DEFAULT_LINE_COUNT + 1))
    signals = [recording.response] + ([] if recording.position is None else [recording.position])
    rest_estimates = [estimate_rest_noise(recording, signal.samples, lines_hz) for signal in signals]
    if all(rest_estimate is not None for rest_estimate in rest_estimates):
        remark = "Nothing repeats in this recording: its noise was measured at rest."
        return _build_noise_floor(
            "rest",
            lines_hz,
            [rest_estimate for rest_estimate in rest_estimates if rest_estimate is not None],
            signals,
            remark,
        )
    quiet_estimates = [estimate_quiet_band_noise(recording, signal.samples, lines_hz) for signal in signals]
    if all(quiet_estimate is not None for quiet_estimate in quiet_estimates):
        remark = (
            "This recording contains neither repeated periods nor a usable stretch of rest: its noise was measured "
            "above the driven band and is assumed to have the same density below."
        )
        return _build_noise_floor(
            "quiet band",
            lines_hz,
            [quiet_estimate for quiet_estimate in quiet_estimates if quiet_estimate is not None],
            signals,
            remark,
        )
    remark = (
        "This recording contains neither repeated periods nor a usable stretch of rest or band that is not driven: its "
        "noise is not known."
    )
    unknown_estimates = [(np.full((len(lines_hz), signal.samples.shape[1]), np.nan), 0.0) for signal in signals]
    return _build_noise_floor("unknown", lines_hz, unknown_estimates, signals, remark)


def choose_least_noise(noise_by_record: Sequence[FloatArray], samples_by_record: Sequence[FloatArray]) -> FloatArray:
    """Choose (c,): rms noise of each channel over all records, each with the noise of the record in which it is least,
    or none where the channel is constant; NaN where it is unknown, or constant in all. noise_by_record: (c,) each;
    samples_by_record: (n, c) each, NaN = missing."""
    is_varying = np.array([np.fmin.reduce(samples) != np.fmax.reduce(samples) for samples in samples_by_record])
    varying_share = np.average(is_varying, axis=0, weights=[len(samples) for samples in samples_by_record])
    return np.asarray(np.fmin.reduce(np.where(is_varying, noise_by_record, np.nan)) * np.sqrt(varying_share))


def _build_noise_floor(
    method: NoiseMethod,
    lines_hz: FloatArray,
    estimates: Sequence[tuple[FloatArray, float]],
    signals: Sequence[Signal],
    remark: str,
) -> NoiseFloor:
    """Build the noise floor from an estimate per signal: density (lines, channels) and its degrees of freedom. Adds to
    the density the quantization error that repeats with the motion."""
    channels = []
    for (density, degrees_of_freedom), signal in zip(estimates, signals, strict=True):
        total_density, rounding = add_repeating_rounding(density, signal.samples)
        channels.append(
            ChannelNoise(
                np.sqrt(total_density.mean(axis=0)), total_density, np.full(len(rounding), degrees_of_freedom), rounding
            )
        )
    return NoiseFloor(method, lines_hz, channels[0], channels[1] if len(channels) > 1 else None, (remark,))


def _estimate_from_repeats(recording: Recording, periods: Sequence[Periods]) -> NoiseFloor:
    """Estimate the noise from the differences between periods, at the spectral lines of the longest period."""
    lines_hz = max(periods, key=lambda period: period.length).compute_line_frequencies(recording.sample_rate_hz)
    response = estimate_repeat_noise(recording, recording.response.samples, periods, lines_hz)
    remarks = _describe_variation(recording.response, response)
    position = None
    if recording.position is not None:
        position = estimate_repeat_noise(recording, recording.position.samples, periods, lines_hz)
        remarks += _describe_variation(recording.position, position)
    return NoiseFloor("repeats", lines_hz, response, position, tuple(remarks))


def _describe_variation(signal: Signal, noise: ChannelNoise) -> list[str]:
    """Describe, in a sentence per channel, segments whose periods differ by more than noise; empty without any."""
    remarks = []
    for channel, name in enumerate(signal.channels):
        varying_count = sum(segment.varies[channel] for segment in noise.segments)
        if varying_count:
            substitute = "that measured at rest" if noise.more_than_rest[channel] else "that of the other segments"
            remarks.append(
                f"{name} ({signal.quantities[channel]}): {varying_count} of {len(noise.segments)} segments differ "
                f"between periods by more than the quietest segment; the noise is {substitute}."
            )
    return remarks
