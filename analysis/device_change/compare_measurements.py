"""Changes between two measurements of a device: each number with its accepted value, standard error and limit.

Compared are dry friction, gain, frequency response by third octaves and noise, of a recording at the acceptance of the
device and of one of today (`measure_device`). Friction and gain count as changed if the difference exceeds both a limit
derived from the smallest step of the published staircases, and three standard errors; friction also if either recording
yields none; a response, if its difference beyond the noise exceeds that limit; noise, if its ratio exceeds a factor
(`ChangeLimits`). Called by `study.workflows.checks.daily_check`."""

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
from equalizer.signals.recording_checks import format_channels
from equalizer.signals.signal import FloatArray


@dataclass(frozen=True, slots=True)
class ChangeLimits:
    """Limits within which two measurements of a device count as equal, from the finest step of a staircase or
    chosen."""

    step_db: float = 1.0
    """Limit of gain and response: the finest step of the published staircases. A smaller change moves a threshold by
    less than a step."""
    friction_n: float = 0.12
    """Limit of friction: a step of 1 dB at the 1 N with which those staircases begin, 10^(1/20) - 1 = 0.12."""
    noise_factor: float = 2.0
    """Limit of the ratio of the noise, chosen by hand: a loose sensor or broken shield multiplies the noise."""
    standard_errors: float = 3.0
    """Number of standard errors beyond which a change is more than the scatter of the measurements, and multiple of the
    noise power that is subtracted from the difference of a response; chosen by hand."""
    band_octaves: float = 1 / 3
    """Width of the bands in which responses are compared: the usual third octaves."""

    @property
    def relative_step(self) -> float:
        """`step_db` as a share of the accepted value."""
        return float(10 ** (self.step_db / 20) - 1)


@dataclass(frozen=True, slots=True)
class Change:
    """One number of a device at its acceptance and today."""

    kind: str
    """One of friction, gain, response and noise."""
    axis: str
    """Channel of the command, or of the response for noise; where lines of a band are not reliable any more, all
    channels of the command, joined by commas."""
    accepted: float
    """Value at the acceptance, in `unit`; a gain is relative to it (1), a response's difference too (0)."""
    today: float
    """Value today; NaN = not measurable."""
    error: float
    """Standard error of the difference, for noise as if both rms were `today`; for a response, the relative rms
    difference that noise alone makes, the largest of all bands. NaN where `today` or `accepted` is NaN."""
    limit: float
    """Limit of the difference; for noise, of the ratio."""
    unit: str
    changed: bool
    """Whether the change exceeds its limit and, but for noise, the scatter of the measurements; also where a friction
    is NaN."""
    band_hz: tuple[float, float] | None = None
    """Band in which a response changed most, or is not reliable any more."""
    peaks_hz: tuple[float, float] | None = None
    """Frequencies of the peak of a changed response, at the acceptance and today; None where it did not change."""
    unclear: bool = False
    """No change was detected, but the error is too large to detect a change of the size of the limit, or (`today` is
    NaN) nothing was measured."""


def compare_measurements(
    baseline: Recording, recording: Recording, limits: ChangeLimits | None = None
) -> tuple[Change, ...]:
    """Compare two measurements of a device: all numbers, changed or not. baseline, recording: the same excitation, at
    the acceptance and today.

    Raises NotMeasurableError where `measure_device` does, where the rates, channels, units or excitations differ, or
    where no frequency is reliable in both."""
    limits = limits or ChangeLimits()
    _require_same_signals(baseline, recording)
    _require_same_excitation(baseline, recording)
    accepted, today = measure_device(baseline), measure_device(recording)
    return (
        *_compare_friction(accepted, today, limits),
        *_compare_responses(accepted.response, today.response, limits),
        *_find_lost_bands(accepted.response, today.response, limits),
        *_compare_noise(accepted, today, limits),
    )


def _require_same_signals(baseline: Recording, recording: Recording) -> None:
    """Raise NotMeasurableError unless both have the same sample rate, and the same channels in the same units."""
    for name, accepted, today in (
        ("sample rate", f"{baseline.sample_rate_hz:.12g} Hz", f"{recording.sample_rate_hz:.12g} Hz"),
        ("command", format_channels(baseline.command), format_channels(recording.command)),
        ("response", format_channels(baseline.response), format_channels(recording.response)),
    ):
        if accepted != today:
            raise NotMeasurableError(f"the {name} is {today} now, but was {accepted} at the acceptance")


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
    """Compare the friction of each axis. A NaN of either recording counts as a change."""
    for axis, channel in enumerate(accepted.response.input_channels):
        accepted_n, today_n = float(accepted.friction_n[axis]), float(today.friction_n[axis])
        error = float(np.hypot(accepted.friction_error_n[axis], today.friction_error_n[axis]))
        is_stuck = math.isnan(today_n) or math.isnan(accepted_n)
        changed = is_stuck or _is_significant(today_n - accepted_n, error, limits.friction_n, limits)
        unclear = not changed and limits.standard_errors * error > limits.friction_n
        yield Change("friction", channel, accepted_n, today_n, error, limits.friction_n, "N", changed, unclear=unclear)


def _compare_responses(accepted: FrequencyResponse, today: FrequencyResponse, limits: ChangeLimits) -> Iterator[Change]:
    """Compare gain and shape of the response to each command, at the frequencies that are reliable in both recordings;
    gains as logarithms. Raises NotMeasurableError where there is no such frequency."""
    common_hz = np.intersect1d(accepted.frequency_hz[accepted.reliable], today.frequency_hz[today.reliable])
    if not len(common_hz):
        raise NotMeasurableError("no frequency is reliable in both recordings")
    accepted, today = (
        measured.select_lines(np.isin(measured.frequency_hz, common_hz)) for measured in (accepted, today)
    )
    for axis, channel in enumerate(accepted.input_channels):
        # Norm over all outputs of the response to this force. Its median ratio over frequency is the change of gain;
        # differences from that common factor are changes of the response.
        ratio = np.linalg.norm(today.response[:, :, axis], axis=1) / np.linalg.norm(
            accepted.response[:, :, axis], axis=1
        )
        gain = float(np.median(ratio))
        if gain == 0:  # a sensor that reads nothing: nothing is said of the shape of its response
            yield Change("gain", channel, 1.0, 0.0, 0.0, limits.relative_step, "", True)
            continue
        # Standard error of a median: sqrt(pi / 2) = 1.2533 times that of a mean; 1.4826 MAD estimates the deviation.
        error = float(1.2533 * 1.4826 * np.median(np.abs(ratio - gain)) / np.sqrt(len(ratio)))
        changed = _is_significant(np.log(gain), error / gain, np.log1p(limits.relative_step), limits)
        unclear = not changed and limits.standard_errors * error > limits.relative_step
        yield Change("gain", channel, 1.0, gain, error, limits.relative_step, "", changed, unclear=unclear)
        yield _find_worst_band(accepted, today, axis, gain, limits)


def _find_lost_bands(accepted: FrequencyResponse, today: FrequencyResponse, limits: ChangeLimits) -> Iterator[Change]:
    """Find the bands in which more than half of the lines that were reliable at the acceptance are not reliable
    today."""
    accepted_hz = accepted.frequency_hz[accepted.reliable]
    is_lost = ~np.isin(accepted_hz, today.frequency_hz[today.reliable])
    band_numbers = _number_bands(accepted_hz, limits)
    for band_number in np.unique(band_numbers):
        in_band = band_numbers == band_number
        if 2 * is_lost[in_band].sum() > in_band.sum():
            band_hz = (float(accepted_hz[in_band][0]), float(accepted_hz[in_band][-1]))
            axes = ", ".join(accepted.input_channels)
            yield Change(
                "response",
                axes,
                0.0,
                math.nan,
                math.nan,
                limits.relative_step,
                "",
                False,
                band_hz=band_hz,
                unclear=True,
            )


def _number_bands(frequency_hz: FloatArray, limits: ChangeLimits) -> FloatArray:
    """Compute (lines,): number of the band of each line, 0 from the lowest line on. frequency_hz: ascending."""
    band_numbers: FloatArray = np.floor(np.log2(frequency_hz / frequency_hz[0]) / limits.band_octaves)
    return band_numbers


def _find_worst_band(
    accepted: FrequencyResponse, today: FrequencyResponse, axis: int, gain: float, limits: ChangeLimits
) -> Change:
    """Find the band in which the response, divided by the common gain, differs most beyond the noise.

    Late and missed ticks make noise in bursts, which affect neighbouring lines alike. Therefore `standard_errors` times
    the power that is expected from the scatter between periods is subtracted from the power of the difference, before
    it is compared with the limit; from the reported value, that power is subtracted once."""
    band_numbers = _number_bands(accepted.frequency_hz, limits)
    band_differences = []
    for band_number in np.unique(band_numbers):
        lines = band_numbers == band_number
        accepted_response, today_response = (
            accepted.response[lines][:, :, axis],
            today.response[lines][:, :, axis] / gain,
        )
        noise = accepted.noise_variance[lines][:, :, axis] + today.noise_variance[lines][:, :, axis] / gain**2
        accepted_power = float(np.sum(np.abs(accepted_response) ** 2))
        difference_power, noise_power = (
            float(np.sum(np.abs(today_response - accepted_response) ** 2)) / accepted_power,
            float(np.sum(noise)) / accepted_power,
        )
        band_lines_hz = accepted.frequency_hz[lines]
        significant_share = float(np.sqrt(max(difference_power - limits.standard_errors * noise_power, 0.0)))
        difference_share = float(np.sqrt(max(difference_power - noise_power, 0.0)))
        band_differences.append(
            (
                significant_share,
                difference_share,
                float(np.sqrt(noise_power)),
                (float(band_lines_hz[0]), float(band_lines_hz[-1])),
            )
        )
    significant_share, difference_share, _, band_hz = max(band_differences)
    error = max(entry[2] for entry in band_differences)
    changed = significant_share > limits.relative_step
    unclear = not changed and error > limits.relative_step
    peaks_hz = (_find_peak_hz(accepted, band_hz, axis), _find_peak_hz(today, band_hz, axis)) if changed else None
    channel = accepted.input_channels[axis]
    return Change(
        "response", channel, 0.0, difference_share, error, limits.relative_step, "", changed, band_hz, peaks_hz, unclear
    )


def _find_peak_hz(response: FrequencyResponse, band_hz: tuple[float, float], axis: int) -> float:
    """Find the frequency of the strongest response to the force along `axis`, within the band extended on either side
    by half of its width in octaves."""
    widening = (band_hz[1] / band_hz[0]) ** 0.5
    lines = response.select_band(band_hz[0] / widening, band_hz[1] * widening)
    strength = np.linalg.norm(lines.response[:, :, axis], axis=1)
    return float(lines.frequency_hz[int(np.argmax(strength))])


def _compare_noise(accepted: DeviceMeasures, today: DeviceMeasures, limits: ChangeLimits) -> Iterator[Change]:
    """Compare the rms at rest of each response. A ratio above the factor, in either direction, is a change."""
    # Relative standard error of the ratio of two rms values of independent samples.
    relative_error = np.sqrt(0.5 / accepted.noise_samples + 0.5 / today.noise_samples)
    for channel, unit, accepted_rms, today_rms in zip(
        accepted.response.output_channels, accepted.response.output_units, accepted.noise, today.noise, strict=True
    ):
        larger_rms, smaller_rms = max(float(accepted_rms), float(today_rms)), min(float(accepted_rms), float(today_rms))
        changed = larger_rms > limits.noise_factor * smaller_rms
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
    """Whether a difference exceeds both its limit and `ChangeLimits.standard_errors`."""
    return bool(abs(difference) > limit and abs(difference) > limits.standard_errors * error)
