"""Changes between two measurements of a device: each number with its accepted value, standard error and limit.

Compared are dry friction, gain, frequency response by third octaves and noise, of a recording at the acceptance of the
device and of one of today (`measure_device`). Friction and gain count as changed if the difference exceeds both a limit
derived from the smallest step of the published staircases, and three standard errors; a response, if its difference
beyond the noise does; noise, if its ratio exceeds a factor (`ChangeLimits`). Called by `hapteq`'s daily check.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from analysis.device_change.measure_device import (
    DeviceMeasures,
    NotMeasurableError,
    measure_device,
)
from equalizer.identification.frequency_response.frequency_response import FrequencyResponse
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray


@dataclass(frozen=True, slots=True)
class ChangeLimits:
    """Limits within which two measurements of a device count as equal: by hand, or the finest step of a staircase."""

    step_db: float = 1.0
    """Limit of gain and response: the finest step of the published staircases. A smaller change moves a threshold by
    less than a step."""
    friction_n: float = 0.12
    """Limit of friction: a step of 1 dB at the 1 N with which those staircases begin, 10^(1/20) - 1 = 0.12."""
    noise_factor: float = 2.0
    """Limit of the noise, chosen by hand: no threshold depends on the noise, and a loose sensor or broken shield
    multiplies it."""
    deviations: float = 3.0
    """Standard errors beyond which a change is more than the scatter of the measurements."""
    band_octaves: float = 1 / 3
    """Width of the bands in which responses are compared: the usual third octaves."""

    @property
    def share(self) -> float:
        """`step_db` as a share of the accepted value."""
        return float(10 ** (self.step_db / 20) - 1)


@dataclass(frozen=True, slots=True)
class Change:
    """One number of a device at its acceptance and today."""

    kind: str
    """friction, gain, response or noise"""
    axis: str
    """Channel of the command, or of the response for noise."""
    accepted: float
    """Value at the acceptance, in `unit`; a gain is relative to it (1), a response's difference too (0)."""
    today: float
    """Value today; NaN = not measurable."""
    error: float
    """Standard error of the difference; for a response, the relative rms difference that noise alone makes."""
    limit: float
    """Limit of the difference; for noise, of the ratio."""
    unit: str
    changed: bool
    """Whether the change exceeds its limit and, but for noise, the scatter of the measurements."""
    band_hz: tuple[float, float] | None = None
    """Band in which a response changed most."""
    peaks_hz: tuple[float, float] | None = None
    """Frequencies of the peak of a changed response, then and now."""
    unclear: bool = False
    """No change was detected, but the error is too large to detect a change of the size of the limit, or (`today` is
    NaN) nothing was measured."""


def compare_devices(
    baseline: Recording, recording: Recording, limits: ChangeLimits | None = None
) -> tuple[Change, ...]:
    """All compared numbers, changed or not. baseline, recording: the same excitation, at the acceptance and today.

    Raises NotMeasurableError where a number cannot be measured in a recording, or where the excitations, channels or
    reliable frequencies of the two do not agree.
    """
    limits = limits or ChangeLimits()
    _require_same_excitation(baseline, recording)
    accepted, today = measure_device(baseline), measure_device(recording)
    return (
        *_compare_friction(accepted, today, limits),
        *_compare_responses(accepted.response, today.response, limits),
        *_find_lost_bands(accepted.response, today.response, limits),
        *_compare_noise(accepted, today, limits),
    )


def _require_same_excitation(baseline: Recording, recording: Recording) -> None:
    """Raise NotMeasurableError unless both have segments of the same kinds, amplitudes and periods, in one order."""
    accepted_segments, segments = (
        [(s.kind, s.amplitude, s.period) for s in measured.segments] for measured in (baseline, recording)
    )
    if len(accepted_segments) != len(segments):
        raise NotMeasurableError(
            f"{len(segments)} segments were played now, but {len(accepted_segments)} at the acceptance"
        )
    for accepted_segment, segment in zip(accepted_segments, segments, strict=True):
        if accepted_segment != segment:
            descriptions = (
                f"a {kind} of {amplitude:.3g} N, {period} samples long"
                for kind, amplitude, period in (segment, accepted_segment)
            )
            raise NotMeasurableError(" was played instead of ".join(descriptions))


def _compare_friction(accepted: DeviceMeasures, today: DeviceMeasures, limits: ChangeLimits) -> Iterator[Change]:
    for axis, channel in enumerate(accepted.response.input_channels):
        accepted_n, today_n = float(accepted.friction_n[axis]), float(today.friction_n[axis])
        error = float(np.hypot(accepted.friction_error_n[axis], today.friction_error_n[axis]))
        # A handle that no longer moves has changed: its friction is unknown, and large.
        stuck = math.isnan(today_n) or math.isnan(accepted_n)
        changed = stuck or _is_significant(today_n - accepted_n, error, limits.friction_n, limits)
        unclear = not changed and limits.deviations * error > limits.friction_n
        yield Change("friction", channel, accepted_n, today_n, error, limits.friction_n, "N", changed, unclear=unclear)


def _compare_responses(accepted: FrequencyResponse, today: FrequencyResponse, limits: ChangeLimits) -> Iterator[Change]:
    if accepted.input_channels != today.input_channels or accepted.output_channels != today.output_channels:
        raise NotMeasurableError("the channels of the two recordings differ")
    shared = np.intersect1d(accepted.frequency_hz[accepted.reliable], today.frequency_hz[today.reliable])
    if not len(shared):
        raise NotMeasurableError("no frequency is reliable in both recordings")
    accepted, today = (measured.select_lines(np.isin(measured.frequency_hz, shared)) for measured in (accepted, today))
    for axis, channel in enumerate(accepted.input_channels):
        # Norm over all outputs of the response to this force. Its median ratio over frequency is the change of gain;
        # differences from that common factor are changes of the response.
        ratio = np.linalg.norm(today.response[:, :, axis], axis=1) / np.linalg.norm(
            accepted.response[:, :, axis], axis=1
        )
        gain = float(np.median(ratio))
        # Standard error of a median: sqrt(pi / 2) = 1.2533 times that of a mean; 1.4826 MAD estimates the deviation.
        error = float(1.2533 * 1.4826 * np.median(np.abs(ratio - gain)) / np.sqrt(len(ratio)))
        changed = _is_significant(np.log(gain), error / gain, np.log1p(limits.share), limits)
        unclear = not changed and limits.deviations * error > limits.share
        yield Change("gain", channel, 1.0, gain, error, limits.share, "", changed, unclear=unclear)
        yield _find_worst_band(accepted, today, axis, gain, limits)


def _find_lost_bands(accepted: FrequencyResponse, today: FrequencyResponse, limits: ChangeLimits) -> Iterator[Change]:
    """Bands in which most lines that were reliable at the acceptance are not reliable today: reported as unclear."""
    accepted_hz = accepted.frequency_hz[accepted.reliable]
    lost = ~np.isin(accepted_hz, today.frequency_hz[today.reliable])
    band = _number_bands(accepted_hz, limits)
    for number in np.unique(band):
        in_band = band == number
        if 2 * lost[in_band].sum() > in_band.sum():
            band_hz = (float(accepted_hz[in_band][0]), float(accepted_hz[in_band][-1]))
            axes = ", ".join(accepted.input_channels)
            yield Change(
                "response", axes, 0.0, math.nan, math.nan, limits.share, "", False, band_hz=band_hz, unclear=True
            )


def _number_bands(frequency_hz: FloatArray, limits: ChangeLimits) -> FloatArray:
    """(lines,): number of the third-octave band of each line, counted from the lowest line."""
    number: FloatArray = np.floor(np.log2(frequency_hz / frequency_hz[0]) / limits.band_octaves)
    return number


def _find_worst_band(
    accepted: FrequencyResponse, today: FrequencyResponse, axis: int, gain: float, limits: ChangeLimits
) -> Change:
    """The third octave in which the response, divided by the common gain, differs most beyond the noise.

    Late and missed ticks make noise in bursts, which affect neighbouring lines alike. Therefore `deviations` times the
    power that is expected from the scatter between periods is subtracted from the power of the difference.
    """
    band = _number_bands(accepted.frequency_hz, limits)
    bands = []
    for number in np.unique(band):
        lines = band == number
        accepted_response, today_response = (
            accepted.response[lines][:, :, axis],
            today.response[lines][:, :, axis] / gain,
        )
        noise = accepted.noise_variance[lines][:, :, axis] + today.noise_variance[lines][:, :, axis] / gain**2
        accepted_power = float(np.sum(np.abs(accepted_response) ** 2))
        power, expected = (
            float(np.sum(np.abs(today_response - accepted_response) ** 2)) / accepted_power,
            float(np.sum(noise)) / accepted_power,
        )
        band_lines_hz = accepted.frequency_hz[lines]
        certain_share = float(np.sqrt(max(power - limits.deviations * expected, 0.0)))
        share = float(np.sqrt(max(power - expected, 0.0)))
        bands.append(
            (certain_share, share, float(np.sqrt(expected)), (float(band_lines_hz[0]), float(band_lines_hz[-1])))
        )
    certain_share, share, _, band_hz = max(bands)
    error = max(entry[2] for entry in bands)
    changed = certain_share > limits.share
    unclear = not changed and error > limits.share
    peaks_hz = (_find_peak_hz(accepted, band_hz, axis), _find_peak_hz(today, band_hz, axis)) if changed else None
    channel = accepted.input_channels[axis]
    return Change("response", channel, 0.0, share, error, limits.share, "", changed, band_hz, peaks_hz, unclear)


def _find_peak_hz(response: FrequencyResponse, band_hz: tuple[float, float], axis: int) -> float:
    """Frequency of the strongest response to the force along `axis`, within the band extended by half on either
    side."""
    widening = (band_hz[1] / band_hz[0]) ** 0.5
    lines = response.select_band(band_hz[0] / widening, band_hz[1] * widening)
    strength = np.linalg.norm(lines.response[:, :, axis], axis=1)
    return float(lines.frequency_hz[int(np.argmax(strength))])


def _compare_noise(accepted: DeviceMeasures, today: DeviceMeasures, limits: ChangeLimits) -> Iterator[Change]:
    # Relative standard error of an rms of independent samples.
    relative_error = np.sqrt(0.5 / accepted.noise_samples + 0.5 / today.noise_samples)
    for channel, accepted_rms, today_rms in zip(
        accepted.response.output_channels, accepted.noise, today.noise, strict=True
    ):
        high, low = max(float(accepted_rms), float(today_rms)), min(float(accepted_rms), float(today_rms))
        changed = high > limits.noise_factor * low
        unit = accepted.response.output_unit
        yield Change(
            "noise",
            channel,
            float(accepted_rms),
            float(today_rms),
            float(relative_error * today_rms),
            limits.noise_factor,
            unit,
            changed,
        )


def _is_significant(difference: float, error: float, limit: float, limits: ChangeLimits) -> bool:
    """Whether a difference exceeds both its limit and `deviations` standard errors."""
    return bool(abs(difference) > limit and abs(difference) > limits.deviations * error)
