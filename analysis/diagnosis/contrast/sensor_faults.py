"""Faults of a sensor, each as the transformation of its readings y that removes it, for size 1.

    sensor_gain    y / gain                  sensor_nonlinearity     x with y = x + c x^3
    sensor_offset  y - shift                 sensor_asymmetry        x with y = x + c x^2
    sensor_drift   y - total ramp            sensor_play             y +- up to half the gap (`_undo_play`)
    logger_offset  y(t + T)                  cross_axis_sensitivity  y - another channel's reading
    clock_drift    y(t / (1 + rate error))   sensor_misalignment     y + R y, R skew-symmetric (three axes)
    sensor_lag     (y(t) - k y(t - Dt)) / (1 - k), k = exp(-Dt / T)

T: delay or time constant in s; Dt: time between rows of the base; ramp: `compute_drift_shape`. Grids of tried values
and limits are chosen by hand; a lag is tried from Dt / 10 on. Called by `rank_faults`."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from analysis.diagnosis.contrast.actuator_faults import (
    EARLIER_DRIFT_SHARES,
    GRID_SIZE,
    SIZE_RANGE,
    choose_trial_delays_s,
    compute_drift_shape,
    compute_median_frequency_hz,
)
from analysis.diagnosis.contrast.fault import (
    ALL_CHANNELS,
    Curve,
    Fault,
    Lags,
    ParametersOf,
    Undo,
    Variant,
    fix_size,
    scale_parameter,
)
from analysis.diagnosis.contrast.interpolation import compute_noise_gain, resample, shift_samples
from analysis.diagnosis.contrast.recording_part import Part
from analysis.diagnosis.limits import LARGEST_CLOCK_ERROR, REVERSAL_SHARE
from equalizer.effects.simulation.dry_friction_kernel import compute_bristle_deflection
from equalizer.signals.signal import FloatArray

ReadingChange = Callable[[FloatArray, float], FloatArray]
"""Function that removes a fault: readings of one channel (n,) and their rate (Hz) to readings without the fault."""
WIDE_RANGE = (0.5, 1.6)
"""Range of sizes, as `SIZE_RANGE`, for faults that act nearly in proportion to their size."""
TRIAL_GAINS = (0.35, 0.5, 0.62, 0.75, 0.85, 0.92, 0.96, 1.04, 1.08, 1.15, 1.25, 1.4, 1.6, 2.0, 2.6)
"""Gains that are tried; the fit of the size covers the gains between neighbours."""
OFFSET_SHARES = (0.03, 0.1, 0.3, 0.7, 1.2)
"""Offsets and drifts that are tried, relative to the standard deviation of the channel."""
NONLINEARITY_SHARES = (0.02, 0.06, 0.15, 0.3)
"""Nonlinearity errors at the largest reading that are tried, as a share of it."""
BACKLASH_SHARES = (0.01, 0.02, 0.05, 0.1, 0.2, 0.4, 0.8)
"""Gaps of a backlash before the sensor that are tried, relative to the standard deviation of the channel."""
CLOCK_DELAYS = (*np.geomspace(0.004, 0.2, GRID_SIZE // 2).tolist(), *np.arange(0.35, 2.0, 0.15).tolist())
"""Tried delays of a clock at the end of the file, in periods of the median frequency; steps below half a period."""
UNIT_DEPENDENT_FAULTS = ("sensor_offset", "sensor_drift")
"""Faults that channels can share only if they have the same unit."""


@dataclass(frozen=True, slots=True)
class _Channels:
    """The response channels with a fault, and the magnitude of their readings in the channels' unit."""

    indices: tuple[int, ...]
    """Indices of the channels: a single one, or all."""
    name: str
    """Name of the channel; empty for all."""
    std: float
    """Standard deviation of the readings, of the largest channel."""
    peak: float
    """Largest magnitude of the readings."""

    def make_fault(self, effect: str, variants: Sequence[Variant], simpler: tuple[str, ...] = ()) -> Fault:
        """Make a fault of these channels. simpler: faults that it contains as special cases."""
        site = self.indices[0] if self.name else ALL_CHANNELS
        return Fault(effect, "sensor", self.name, site, tuple(variants), simpler)

    def make_undo(self, undo_readings: ReadingChange) -> Undo:
        """Make the function that applies `undo_readings` to these channels of a part."""

        def undo(part: Part) -> Part:
            response = part.response.copy()
            for index in self.indices:
                response[:, index] = undo_readings(response[:, index], part.rate_hz)
            return replace(part, response=response)

        return undo


def make_sensor_faults(index: int, name: str, parts: Sequence[Part], lags: Lags) -> Iterator[Fault]:
    """Make all faults of channel `index`. parts: all compared, whose range the grids span; lags: likely delays."""
    readings = np.concatenate([part.response[:, index] for part in parts])
    channel = _Channels((index,), name, float(np.std(readings)) or 1.0, float(np.abs(readings).max(initial=0.0)) or 1.0)
    longest_part = max(parts, key=lambda part: len(part.response))
    yield from _make_common_faults(channel, parts, longest_part.response[:, index], lags)
    shares = [sign * share for share in NONLINEARITY_SHARES for sign in (1.0, -1.0)]
    yield channel.make_fault("sensor_nonlinearity", [_make_power_law(channel, share, 3, "cubic") for share in shares])
    yield channel.make_fault("sensor_asymmetry", [_make_power_law(channel, share, 2, "square") for share in shares])
    yield channel.make_fault("sensor_play", [_make_backlash(channel, share * channel.std) for share in BACKLASH_SHARES])
    for source in (*range(index), *range(index + 1, count := longest_part.response.shape[1])):
        names = ("from_next", "from_after_next")[:: -1 if (source - index) % count == 2 else 1]
        yield _make_cross_axis_fault(channel, source, *names)


def make_shared_faults(parts: Sequence[Part], lags: Lags) -> Iterator[Fault]:
    """Make the faults of all channels together, as of one supply, filter or logger. See `make_sensor_faults`."""
    readings = np.vstack([part.response for part in parts])
    channel_std = np.std(readings, axis=0)
    largest_channel = int(np.argmax(channel_std))
    peak = float(np.abs(readings).max(initial=0.0)) or 1.0
    channel = _Channels(tuple(range(readings.shape[1])), "", float(channel_std[largest_channel]) or 1.0, peak)
    longest_part = max(parts, key=lambda part: len(part.response))
    has_one_unit = len(set(longest_part.recording.response.units)) == 1
    for fault in _make_common_faults(channel, parts, longest_part.response[:, largest_channel], lags):
        if has_one_unit or fault.effect not in UNIT_DEPENDENT_FAULTS:
            yield fault


def _make_common_faults(channel: _Channels, parts: Sequence[Part], samples: FloatArray, lags: Lags) -> Iterator[Fault]:
    """Make the faults that one channel or all together may have. samples: (n,), readings of the longest part."""
    longest_part = max(parts, key=lambda part: len(part.response))
    delays_s = choose_trial_delays_s(samples, longest_part.rate_hz)
    yield channel.make_fault("sensor_gain", [_make_gain(channel, gain) for gain in TRIAL_GAINS])
    offsets = [sign * share * channel.std for share in OFFSET_SHARES for sign in (1.0, -1.0)]
    yield channel.make_fault("sensor_offset", [_make_offset(channel, offset) for offset in offsets])
    drifts = [_make_drift(channel, offset, earlier) for offset in offsets for earlier in EARLIER_DRIFT_SHARES]
    yield replace(channel.make_fault("sensor_drift", drifts, ("sensor_offset",)), varies=True)
    yield channel.make_fault("logger_offset", [
        *(_make_logger_offset(channel, time_s, longest_part.rate_hz) for time_s in delays_s), *(
            fix_size(_make_logger_offset(channel, time_s, longest_part.rate_hz), lags.step_s)
            for time_s in lags.delays_s),
    ])  # fmt: skip
    lag_times_s = [time_s for time_s in delays_s if time_s * longest_part.rate_hz >= 0.1 * lags.lag_samples]
    yield channel.make_fault(
        "sensor_lag", [_make_lag(channel, time_s, longest_part.rate_hz, lags.lag_samples) for time_s in lag_times_s]
    )
    period_samples = longest_part.rate_hz / compute_median_frequency_hz(samples, longest_part.rate_hz)
    rates = [sign * delay * period_samples / longest_part.file_length for delay in CLOCK_DELAYS for sign in (1.0, -1.0)]
    clock_origins = (True, False) if any(part.start > 0 for part in parts) else (True,)
    clocks = [
        _make_clock_drift(channel, rate, from_file_start, parts)
        for rate in rates
        if abs(rate) < LARGEST_CLOCK_ERROR
        for from_file_start in clock_origins
    ]
    clocks += [
        fix_size(_make_clock_drift(channel, clock.rate, clock.from_file_start, parts), 1e6 * clock.step)
        for clock in lags.clocks
    ]
    yield replace(channel.make_fault("clock_drift", clocks), varies=True)


def _make_backlash(channel: _Channels, gap: float) -> Variant:
    """Make a backlash before the sensor. gap: its full width, in the channel's unit."""
    return Variant((channel.make_undo(lambda y, rate: _undo_play(y, gap)),), scale_parameter("gap", gap), *WIDE_RANGE)


def _undo_play(y: FloatArray, gap: float) -> FloatArray:
    """Estimate (n,): the motion that drives a reading y (n,) through a backlash. It leads the reading by half the gap,
    reverses at an extreme of the reading, and has crossed the gap when the reading reverses. In between, the lead
    changes with the square of time."""
    direction = np.sign(compute_bristle_deflection(y, REVERSAL_SHARE * gap))
    relative_lead = 0.5 * direction
    reversals = np.flatnonzero(direction[1:] * direction[:-1] < 0) + 1
    for start, reversal in pairwise([0, *reversals.tolist()]):
        excursion = direction[reversal - 1] * y[start:reversal]
        extreme = start + int(np.argmax(excursion))
        end = extreme + int(np.flatnonzero(excursion[extreme - start :] > excursion.max() - REVERSAL_SHARE * gap)[-1])
        crossed_share = (np.arange(extreme, reversal) - extreme) / max(end - extreme, 1)
        relative_lead[extreme:reversal] = direction[reversal - 1] * (0.5 - np.minimum(crossed_share, 1.0) ** 2)
    return np.asarray(y + gap * relative_lead)


def _make_cross_axis_fault(channel: _Channels, source: int, share: str, other_share: str) -> Fault:
    """Make cross-axis sensitivity to channel `source`: its share in the catalogue; the other share is 0."""
    (channel_index,) = channel.indices

    def undo(part: Part) -> Part:
        response = part.response.copy()
        response[:, channel_index] -= part.response[:, source]
        return replace(part, response=response)

    variant = Variant((undo,), lambda sizes: {share: float(sizes[0]), other_share: 0.0})
    return channel.make_fault("cross_axis_sensitivity", [variant])


def _make_gain(channel: _Channels, gain: float) -> Variant:
    """Make a wrong gain, linearised about `gain`; its size is 1 there, and 0 at gain 1."""
    undo = channel.make_undo(lambda y, rate: y / gain)
    compute_gain: Callable[[float], float] = lambda size: 1 / (1 + size * (1 / gain - 1))  # noqa: E731
    at_size = lambda size: _make_gain(channel, compute_gain(size))  # noqa: E731
    return Variant((undo,), lambda s: {"gain": compute_gain(float(s[0]))}, *SIZE_RANGE, gain, at_size=at_size)


def _make_offset(channel: _Channels, shift: float) -> Variant:
    """Make a constant offset, in the channel's unit."""
    return Variant((channel.make_undo(lambda y, rate: y - shift),), scale_parameter("offset", shift), *WIDE_RANGE)


def _make_drift(channel: _Channels, total: float, earlier_share: float) -> Variant:
    """Make an offset that grows linearly to `total`. earlier_share: share of it before the file began."""

    def undo(part: Part) -> Part:
        response = part.response.copy()
        response[:, list(channel.indices)] -= total * compute_drift_shape(part, earlier_share)[:, None]
        return replace(part, response=response)

    return Variant((undo,), scale_parameter("total", total), *WIDE_RANGE)


def _make_logger_offset(channel: _Channels, delay_s: float, rate_hz: float) -> Variant:
    """Make a delay: readings recorded `delay_s` late. rate_hz: of the longest part, for `compute_noise_gain`."""

    def undo(part: Part) -> Part:
        delay_samples = delay_s * part.rate_hz
        undone = channel.make_undo(lambda y, rate: shift_samples(y[:, None], -delay_samples)[:, 0])(part)
        return replace(undone, known=part.known & (np.arange(len(part.known)) < len(part.known) - delay_samples))

    at_size = lambda size: _make_logger_offset(channel, size * delay_s, rate_hz)  # noqa: E731
    noise_factor = compute_noise_gain(delay_s * rate_hz)
    return Variant(
        (undo,), scale_parameter("offset", delay_s), *SIZE_RANGE, noise_factor=noise_factor,
        at_size=at_size, one_size=True,
    )  # fmt: skip


def _make_lag(channel: _Channels, time_s: float, rate_hz: float, row_samples: int) -> Variant:
    """Make a low pass of first order, y += (1 - decay) (x - y) per `row_samples`, inverted exactly. An autoregression
    predicts a row from earlier rows alone, so that samples between rows are not used here either. The low pass reduces
    one-step prediction errors by the geometric mean of its gain, 1 - decay (Kolmogorov's formula)."""
    decay = float(np.exp(-row_samples / (time_s * rate_hz)))
    undo = channel.make_undo(
        lambda y, rate: (y - decay * np.concatenate([y[:1]] * row_samples + [y])[: len(y)]) / (1 - decay)
    )
    parameters_of: ParametersOf = lambda s: {"bandwidth": 1 / (2 * np.pi * time_s * float(s[0]))}  # noqa: E731
    at_size = lambda size: _make_lag(channel, size * time_s, rate_hz, row_samples)  # noqa: E731
    return Variant((undo,), parameters_of, *SIZE_RANGE, 1 - decay, at_size=at_size)


def _make_power_law(channel: _Channels, share: float, power: int, parameter_name: str) -> Variant:
    """Make an additional term of power 2 or 3. share: its value at the largest reading, relative to that reading."""
    peak = channel.peak
    curve: Curve = lambda y: _invert_power_law(y / peak, share, power) * peak  # noqa: E731
    at_size = lambda size: _make_power_law(channel, size * share, power, parameter_name)  # noqa: E731
    parameters_of = scale_parameter(parameter_name, share / peak ** (power - 1))
    return Variant(
        (channel.make_undo(lambda y, rate: curve(y)),), parameters_of, *WIDE_RANGE, curve=curve, at_size=at_size
    )


def _invert_power_law(y: FloatArray, share: float, power: int) -> FloatArray:
    """Solve y = x + share x^power for x (n,) by 20 Newton steps. A slope within +-0.1 counts as 0.1, so that steps stay
    short near a turning point; clipped to -3 to 3. y: readings over the largest."""
    x = y.copy()
    for _ in range(20):
        slope = 1 + power * share * x ** (power - 1)
        x = x - (x + share * x**power - y) / np.where(np.abs(slope) > 0.1, slope, 0.1)
    return np.asarray(np.clip(x, -3.0, 3.0))


def _make_clock_drift(channel: _Channels, rate_error: float, from_file_start: bool, parts: Sequence[Part]) -> Variant:
    """Make a drift of the clock: readings taken at t (1 + rate_error), resampled to t. from_file_start: whether t
    counts from the beginning of the file, else of each part."""

    def compute_read_times(part: Part) -> FloatArray:
        offset = part.start if from_file_start else 0
        return np.asarray((offset + np.arange(len(part.response))) / (1 + rate_error) - offset)

    def undo(part: Part) -> Part:
        times = compute_read_times(part)
        undone = channel.make_undo(lambda y, rate: resample(y, times))(part)
        return replace(undone, known=part.known & (times >= 0) & (times <= len(times) - 1))

    at_size = lambda size: _make_clock_drift(channel, size * rate_error, from_file_start, parts)  # noqa: E731
    noise_factor = compute_noise_gain(np.concatenate([compute_read_times(part) for part in parts]))
    return Variant(
        (undo,), scale_parameter("ppm", 1e6 * rate_error), *SIZE_RANGE, noise_factor=noise_factor,
        at_size=at_size, one_size=True,
    )  # fmt: skip


ROTATION_GENERATORS = (
    ((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, -1.0, 0.0)),
    ((0.0, 0.0, -1.0), (0.0, 0.0, 0.0), (1.0, 0.0, 0.0)),
    ((0.0, 1.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
)
"""Generators of rotations about three axes: undoing one by a small angle s (rad) adds s x generator x readings."""


def make_misalignment_fault() -> Fault:
    """Make a rotation of a three-axis sensor by small angles, to first order. Its three sizes are angles in rad."""

    def make_undo(generator: FloatArray) -> Undo:
        return lambda part: replace(part, response=part.response + part.response @ generator.T)

    undo = tuple(make_undo(np.array(generator)) for generator in ROTATION_GENERATORS)
    variant = Variant(undo, lambda s: {"degrees": float(np.degrees(np.linalg.norm(s)))})
    return Fault("sensor_misalignment", "sensor", "", ALL_CHANNELS, (variant,))
