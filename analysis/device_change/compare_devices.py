"""Changes between two measurements of a device: each number with its accepted value, standard error and limit.

Compared are dry friction, gain, frequency response by third octaves and noise, of a recording at the acceptance of the
device and of one of today (`measure_device`). A number counts as changed if the difference exceeds both its limit,
derived from the smallest step of the published staircases, and three standard errors (`ChangeLimits`).
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
    """Whether the change exceeds both its limit and the scatter of the measurements."""
    band_hz: tuple[float, float] | None = None
    """Band in which a response changed most."""
    peaks_hz: tuple[float, float] | None = None
    """Frequencies of the peak of a changed response, then and now."""
    unclear: bool = False
    """Nothing was seen to change, and it was measured too inaccurately to see a change of the limit's size, or (today
    is NaN) not at all."""


def compare_devices(
    baseline: Recording, recording: Recording, limits: ChangeLimits | None = None
) -> tuple[Change, ...]:
    """All compared numbers, changed or not. baseline, recording: the same excitation, at the acceptance and today.

    Raises NotMeasurableError where a number cannot be measured in a recording, or where the excitations, channels or
    reliable frequencies of the two do not agree.
    """
    limits = limits or ChangeLimits()
    _check_played_alike(baseline, recording)
    accepted, today = measure_device(baseline), measure_device(recording)
    return (
        *_friction_changes(accepted, today, limits),
        *_response_changes(accepted.response, today.response, limits),
        *_lost_bands(accepted.response, today.response, limits),
        *_noise_changes(accepted, today, limits),
    )


def _check_played_alike(baseline: Recording, recording: Recording) -> None:
    """Raise NotMeasurableError unless both have segments of the same kinds, amplitudes and periods, in one order."""
    then, now = ([(s.kind, s.amplitude, s.period) for s in each.segments] for each in (baseline, recording))
    if len(then) != len(now):
        raise NotMeasurableError(f"{len(now)} segments were played now, but {len(then)} at the acceptance")
    for before, after in zip(then, now, strict=True):
        if before != after:
            words = (
                f"a {kind} of {amplitude:.3g} N, {period} samples long" for kind, amplitude, period in (after, before)
            )
            raise NotMeasurableError(" was played instead of ".join(words))


def _friction_changes(accepted: DeviceMeasures, today: DeviceMeasures, limits: ChangeLimits) -> Iterator[Change]:
    for axis, channel in enumerate(accepted.response.input_channels):
        then, now = float(accepted.friction_n[axis]), float(today.friction_n[axis])
        error = float(np.hypot(accepted.friction_error_n[axis], today.friction_error_n[axis]))
        # A handle that no longer moves has changed: its friction is unknown, and large.
        stuck = math.isnan(now) or math.isnan(then)
        changed = stuck or _is_beyond(now - then, error, limits.friction_n, limits)
        unclear = not changed and limits.deviations * error > limits.friction_n
        yield Change("friction", channel, then, now, error, limits.friction_n, "N", changed, unclear=unclear)


def _response_changes(then: FrequencyResponse, now: FrequencyResponse, limits: ChangeLimits) -> Iterator[Change]:
    if then.input_channels != now.input_channels or then.output_channels != now.output_channels:
        raise NotMeasurableError("the channels of the two recordings differ")
    shared = np.intersect1d(then.frequency_hz[then.reliable], now.frequency_hz[now.reliable])
    if not len(shared):
        raise NotMeasurableError("no frequency is reliable in both recordings")
    then, now = (each.of_lines(np.isin(each.frequency_hz, shared)) for each in (then, now))
    for axis, channel in enumerate(then.input_channels):
        # Norm over all outputs of the response to this force. Its median ratio over frequency is the change of gain;
        # differences from that common factor are changes of the response.
        ratio = np.linalg.norm(now.response[:, :, axis], axis=1) / np.linalg.norm(then.response[:, :, axis], axis=1)
        gain = float(np.median(ratio))
        # Standard error of a median: sqrt(pi / 2) = 1.2533 times that of a mean; 1.4826 MAD estimates the deviation.
        error = float(1.2533 * 1.4826 * np.median(np.abs(ratio - gain)) / np.sqrt(len(ratio)))
        changed = _is_beyond(np.log(gain), error / gain, np.log1p(limits.share), limits)
        unclear = not changed and limits.deviations * error > limits.share
        yield Change("gain", channel, 1.0, gain, error, limits.share, "", changed, unclear=unclear)
        yield _worst_band(then, now, axis, gain, limits)


def _lost_bands(then: FrequencyResponse, now: FrequencyResponse, limits: ChangeLimits) -> Iterator[Change]:
    """Bands in which most lines that were reliable at the acceptance are not reliable today: reported as unclear."""
    before_hz = then.frequency_hz[then.reliable]
    lost = ~np.isin(before_hz, now.frequency_hz[now.reliable])
    band = _bands(before_hz, limits)
    for number in np.unique(band):
        here = band == number
        if 2 * lost[here].sum() > here.sum():
            band_hz = (float(before_hz[here][0]), float(before_hz[here][-1]))
            axes = ", ".join(then.input_channels)
            yield Change(
                "response", axes, 0.0, math.nan, math.nan, limits.share, "", False, band_hz=band_hz, unclear=True
            )


def _bands(frequency_hz: FloatArray, limits: ChangeLimits) -> FloatArray:
    """(lines,): number of the third-octave band of each line, counted from the lowest line."""
    number: FloatArray = np.floor(np.log2(frequency_hz / frequency_hz[0]) / limits.band_octaves)
    return number


def _worst_band(
    then: FrequencyResponse, now: FrequencyResponse, axis: int, gain: float, limits: ChangeLimits
) -> Change:
    """The third octave in which the response, divided by the common gain, differs most beyond the noise.

    Late and missed ticks make noise in bursts, which affect neighbouring lines alike. Therefore `deviations` times the
    power that is expected from the scatter between periods is subtracted from the power of the difference.
    """
    band = _bands(then.frequency_hz, limits)
    found = []
    for number in np.unique(band):
        lines = band == number
        before, after = then.response[lines][:, :, axis], now.response[lines][:, :, axis] / gain
        noise = then.noise_variance[lines][:, :, axis] + now.noise_variance[lines][:, :, axis] / gain**2
        size = float(np.sum(np.abs(before) ** 2))
        power, expected = float(np.sum(np.abs(after - before) ** 2)) / size, float(np.sum(noise)) / size
        at_hz = then.frequency_hz[lines]
        surely = float(np.sqrt(max(power - limits.deviations * expected, 0.0)))
        share = float(np.sqrt(max(power - expected, 0.0)))
        found.append((surely, share, float(np.sqrt(expected)), (float(at_hz[0]), float(at_hz[-1]))))
    surely, share, _, band_hz = max(found)
    error = max(each[2] for each in found)
    changed = surely > limits.share
    unclear = not changed and error > limits.share
    peaks_hz = (_peak_hz(then, band_hz, axis), _peak_hz(now, band_hz, axis)) if changed else None
    channel = then.input_channels[axis]
    return Change("response", channel, 0.0, share, error, limits.share, "", changed, band_hz, peaks_hz, unclear)


def _peak_hz(response: FrequencyResponse, band_hz: tuple[float, float], axis: int) -> float:
    """Frequency of the strongest response to the force along `axis`, within the band extended by half on either
    side."""
    wider = (band_hz[1] / band_hz[0]) ** 0.5
    lines = response.within(band_hz[0] / wider, band_hz[1] * wider)
    strength = np.linalg.norm(lines.response[:, :, axis], axis=1)
    return float(lines.frequency_hz[int(np.argmax(strength))])


def _noise_changes(accepted: DeviceMeasures, today: DeviceMeasures, limits: ChangeLimits) -> Iterator[Change]:
    # Relative standard error of an rms of independent samples.
    relative = np.sqrt(0.5 / accepted.noise_samples + 0.5 / today.noise_samples)
    for channel, then, now in zip(accepted.response.output_channels, accepted.noise, today.noise, strict=True):
        high, low = max(float(then), float(now)), min(float(then), float(now))
        changed = high > limits.noise_factor * low
        unit = accepted.response.output_unit
        yield Change(
            "noise", channel, float(then), float(now), float(relative * now), limits.noise_factor, unit, changed
        )


def _is_beyond(difference: float, error: float, limit: float, limits: ChangeLimits) -> bool:
    """Whether a difference exceeds both its limit and `deviations` standard errors."""
    return bool(abs(difference) > limit and abs(difference) > limits.deviations * error)
