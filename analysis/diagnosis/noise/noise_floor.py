"""Estimates the noise of a recording's response and position, by the first of three methods that it allows: repeated
periods, stretches at rest, lines above the driven band. Called by `choose_measure` and `rigid_model`."""

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
_LINES = 511
"""Number of lines where no period gives a grid."""


@dataclass(frozen=True, slots=True, eq=False)
class NoiseFloor:
    """Noise of a recording's response and position, and the method by which it was estimated."""

    method: NoiseMethod
    frequency_hz: FloatArray
    """(lines,)"""
    response: ChannelNoise
    position: ChannelNoise | None
    remarks: tuple[str, ...]
    """Sentences on the method of the estimate, and on its weaknesses."""

    @property
    def response_rms(self) -> FloatArray:
        """Noise of the response (p channels); NaN where `how` is "unknown"."""
        return self.response.rms

    @property
    def position_rms(self) -> FloatArray | None:
        """Noise of the position (d channels)."""
        return None if self.position is None else self.position.rms

    @property
    def is_known(self) -> bool:
        """Whether the noise could be estimated; else every rms is NaN."""
        return self.method != "unknown"


def estimate_noise_floor(recording: Recording) -> NoiseFloor:
    """Estimate the noise from repeated periods; else from rest; else from the lines above the driven band, assumed to
    be white; else `how` is "unknown" and every rms NaN."""
    periods = tuple(period for period in find_settled_periods(recording) if period.count > 1)
    if periods:
        return _estimate_from_repeats(recording, periods)
    rate = recording.sample_rate_hz
    lines_hz: FloatArray = np.arange(1.0, _LINES + 1) * (rate / 2 / (_LINES + 1))
    signals = [recording.response] + ([] if recording.position is None else [recording.position])
    rest_estimates = [estimate_rest_noise(recording, signal.samples, lines_hz) for signal in signals]
    if all(rest_estimate is not None for rest_estimate in rest_estimates):
        remark = "Nothing repeats in this recording: its noise was measured at rest."
        return _build_floor(
            "rest",
            lines_hz,
            [rest_estimate for rest_estimate in rest_estimates if rest_estimate is not None],
            signals,
            remark,
        )
    quiet_estimates = [estimate_quiet_band_noise(recording, signal.samples, lines_hz) for signal in signals]
    if all(quiet_estimate is not None for quiet_estimate in quiet_estimates):
        remark = (
            "Nothing repeats in this recording and it never rests: its noise was measured above the driven band and "
            "is assumed to have the same density below."
        )
        return _build_floor(
            "quiet band",
            lines_hz,
            [quiet_estimate for quiet_estimate in quiet_estimates if quiet_estimate is not None],
            signals,
            remark,
        )
    remark = "Nothing repeats in this recording, it never rests and all its band is driven: its noise is not known."
    unknown = [(np.full((len(lines_hz), signal.samples.shape[1]), np.nan), 0.0) for signal in signals]
    return _build_floor("unknown", lines_hz, unknown, signals, remark)


def _build_floor(
    method: NoiseMethod,
    lines_hz: FloatArray,
    estimates: Sequence[tuple[FloatArray, float]],
    signals: Sequence[Signal],
    remark: str,
) -> NoiseFloor:
    channels = []
    for (density, freedom), signal in zip(estimates, signals, strict=True):
        total_density, rounding = add_repeating_rounding(density, signal.samples)
        channels.append(
            ChannelNoise(np.sqrt(total_density.mean(axis=0)), total_density, np.full(len(rounding), freedom), rounding)
        )
    return NoiseFloor(method, lines_hz, channels[0], channels[1] if len(channels) > 1 else None, (remark,))


def _estimate_from_repeats(recording: Recording, periods: Sequence[Periods]) -> NoiseFloor:
    lines_hz = max(periods, key=lambda period: period.length).compute_line_frequencies(recording.sample_rate_hz)
    response = estimate_repeat_noise(recording, recording.response.samples, periods, lines_hz)
    remarks = _describe_variation(recording.response, response)
    position = None
    if recording.position is not None:
        position = estimate_repeat_noise(recording, recording.position.samples, periods, lines_hz)
        remarks += _describe_variation(recording.position, position)
    return NoiseFloor("repeats", lines_hz, response, position, tuple(remarks))


def _describe_variation(signal: Signal, noise: ChannelNoise) -> list[str]:
    remarks = []
    for index, name in enumerate(signal.channels):
        varying = sum(segment.varies[index] for segment in noise.segments)
        if varying:
            substitute = "that measured at rest" if noise.more_than_rest[index] else "that of the other segments"
            remarks.append(
                f"{name} ({signal.quantities[index]}): {varying} of {len(noise.segments)} segments differ between "
                f"periods by more than the quietest segment; the noise is {substitute}."
            )
    return remarks
