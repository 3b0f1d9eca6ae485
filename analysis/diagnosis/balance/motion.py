"""Positions, velocities, accelerations and forces from recordings, for force balances.

With a time axis, derivatives are computed in the frequency domain: each spectral line is multiplied by (i omega)^order
and low-pass filtered. The upper end of the band is the highest frequency up to which white noise makes at most a
hundredth of the acceleration's mean square, because regression on a noisier acceleration would underestimate the mass
by more (errors in variables; Soderstrom, Automatica 43:939, 2007). Measured accelerations are integrated above a lower
end of the band only, below which noise would dominate the position (`band.py`). Begin at `compute_motions`.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from scipy.fft import rfft, rfftfreq

from analysis.diagnosis.balance.band import LEAST_BAND_BEGIN_CYCLES, compute_band_begin_hz, compute_band_end_hz
from analysis.diagnosis.data.measured_motion import fill_gaps, is_free_motion, is_quasi_static
from analysis.diagnosis.data.observed import Observed
from analysis.diagnosis.limits import MOTION_EDGE_PERIODS, MOTION_OVERSAMPLED, MOVING_BAND_SHARE
from analysis.diagnosis.types import Mask
from equalizer.effects.discovered_law import collect_channels, name_conditions
from equalizer.plant.mechanical_model import DERIVATIVE_OF_QUANTITY
from equalizer.signals.band_limited import compute_end_to_end_line, compute_low_pass_gain, filter_spectrum
from equalizer.signals.recording import Hold, Recording
from equalizer.signals.signal import FloatArray, Signal


class NoMotionError(ValueError):
    """The recording has no motion that a force balance can use."""


@dataclass(frozen=True, slots=True)
class Condition:
    """A recorded condition that changes within the recordings, such as a temperature, with its mean and spread there,
    in its own unit."""

    name: str
    """Name in a formula."""
    mean: float
    standard_deviation: float


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """Motion and force in one part of a recording, n samples at its rate, in SI units. Position, velocity and
    acceleration, (n, d), are band-limited and may be advanced or 0 (`compute_motions`); force and conditions not."""

    rate_hz: float
    """Sample rate in Hz."""
    band_hz: float
    """Upper end of the band in Hz; infinite without a time axis: then nothing is filtered, and accelerations are 0."""
    step: int
    """Decimation factor after filtering: every `step`-th sample is kept."""
    channels: tuple[str, ...]
    order: int
    """Order of the position's time derivative that was measured: 0, 1 or 2; 0 without a time axis."""
    position: FloatArray
    """(n, d): as measured, or integrated: a velocity by summation from the first sample on, an acceleration in the
    frequency domain."""
    velocity: FloatArray
    """(n, d); without a time axis, the change of the position per sample."""
    acceleration: FloatArray
    force: FloatArray
    """(n, m): as commanded or measured, or computed from that with an actuator's law, known effects or a delay."""
    condition: FloatArray
    """(n, q): recorded conditions such as a temperature, standardised; q may be 0."""
    fit: Mask
    """(n,): samples for estimation: those to fit and those for validation (`Observed.fit`, `Observed.choose`)."""
    test: Mask
    """(n,): held-out samples."""
    lowest_hz: float = 0.0
    """Lower end of the band in Hz: above 0 for integrated accelerations."""
    conditions: tuple[Condition, ...] = ()
    """Recorded conditions, for the columns of `condition`."""

    def decimate(self, columns: FloatArray) -> FloatArray:
        """Filter columns (n, k) to the band and decimate them by `step`: (kept samples, k). Unchanged without a time
        axis."""
        if not np.isfinite(self.band_hz):
            return columns
        return self.filter_to_band(columns)[:: self.step]

    def filter_to_band(self, columns: FloatArray) -> FloatArray:
        """Filter columns (n, k) to the band, at the recording's rate. Needs a finite `band_hz`."""
        return filter_band_pass(columns, self.rate_hz, self.band_hz, self.lowest_hz)

    def mask_valid_samples(self, mask: Mask) -> Mask:
        """Mask (kept samples,) of the samples in a mask (n,), without `MOTION_EDGE_PERIODS` periods of the band's lower
        end, or of its upper end where there is no lower one, but at least one sample, at either end of the part. None
        where the part has fewer than `LEAST_BAND_BEGIN_CYCLES` periods of the lower end."""
        edge_samples = int(MOTION_EDGE_PERIODS * self.rate_hz / (self.lowest_hz or self.band_hz)) + 1
        interior = np.zeros(len(mask), dtype=np.bool_)
        if round(len(mask) * self.lowest_hz / self.rate_hz, 6) >= LEAST_BAND_BEGIN_CYCLES or self.lowest_hz == 0:
            interior[edge_samples : len(mask) - edge_samples] = True
        return (mask & interior)[:: self.step]


def find_motion_signals(recordings: Sequence[Recording]) -> tuple[Signal, ...]:
    """Find the channels to compute the motion from, the same for all recordings: in the positions and in the responses,
    those of the lowest measured order of the position's time derivative (0, 1 or 2) that vary in any recording; of the
    two, those of the lower order, or the positions'. Empty without any."""
    candidates: list[tuple[int, tuple[Signal, ...]]] = []
    for signals in ([each.position for each in recordings], [each.response for each in recordings]):
        present_signals = [signal for signal in signals if signal is not None]
        if not present_signals or len(present_signals) < len(signals):
            continue
        orders = [DERIVATIVE_OF_QUANTITY.get(quantity) for quantity in present_signals[0].quantities]
        lowest_order = min((order for order in orders if order is not None), default=-1)
        columns = [
            column
            for column, order in enumerate(orders)
            if order == lowest_order and any(_is_varying(signal.samples[:, column]) for signal in present_signals)
        ]
        if columns:
            candidates.append((lowest_order, tuple(signal.select_channels(columns) for signal in present_signals)))
    return min(candidates, key=lambda item: item[0])[1] if candidates else ()


def _is_varying(samples: FloatArray) -> bool:
    """Whether the finite samples are not all equal."""
    finite_samples = samples[np.isfinite(samples)]
    return bool(len(finite_samples)) and float(np.ptp(finite_samples)) > 0


def compute_motions(records: Sequence[Observed], band_hz: float | None = None) -> tuple[Motion, ...]:
    """Compute the motion of each record, with derivatives and forces; missing samples are interpolated. Positions are
    fused with measured accelerations. Under a zero-order hold, a motion that was not imposed is advanced by half a
    sample; the acceleration of a free motion is set to zero. records: with the same channels, units and rate. band_hz:
    upper end of the band (Hz); None = the highest that the noise allows. Raises NoMotionError where there are no
    records, or a record contains no motion."""
    motion_signals = find_motion_signals([record.recording for record in records])
    if not motion_signals or not all(any(map(_is_varying, signal.samples.T)) for signal in motion_signals):
        raise NoMotionError("no response is a position, velocity or acceleration")
    order = DERIVATIVE_OF_QUANTITY[motion_signals[0].quantities[0]]
    rate_hz = records[0].recording.sample_rate_hz
    filled_samples = [fill_gaps(signal.samples) for signal in motion_signals]
    is_untimed = any(is_quasi_static(record.recording) for record in records)
    if band_hz is None:
        band_hz = np.inf if is_untimed else compute_band_end_hz(filled_samples, rate_hz, order)
    lowest_hz = compute_band_begin_hz(filled_samples, rate_hz) if order == 2 and not is_untimed else 0.0
    if order == 0 and np.isfinite(band_hz):
        from analysis.diagnosis.balance.fused_motion import fuse_with_accelerations

        filled_samples = fuse_with_accelerations(records, filled_samples, band_hz)
    conditions, condition_samples = _standardise_conditions(records)
    return tuple(
        replace(
            _compute_motion(record, (samples, order), (band_hz, lowest_hz), condition, motion_signals[0].channels),
            conditions=conditions,
        )
        for record, samples, condition in zip(records, filled_samples, condition_samples, strict=True)
    )


def compute_motion_band_hz(motions: Sequence[Motion], columns: Iterable[int]) -> float:
    """Compute the frequency in Hz below which `MOVING_BAND_SHARE` of the variance of a channel's velocity lies, the
    highest over the channels; infinite without a time axis. motions: at least one; columns: indices of the channels, at
    least one."""
    if not np.isfinite(motions[0].band_hz):
        return np.inf
    channel_ends_hz = []
    for column in columns:
        motion_power, motion_frequencies_hz = [], []
        for motion in motions:
            speed = motion.velocity[:, column]
            motion_power.append(np.abs(rfft(speed - speed.mean())) ** 2 / len(speed))
            motion_frequencies_hz.append(rfftfreq(len(speed), 1 / motion.rate_hz))
        all_power, all_frequencies_hz = np.concatenate(motion_power), np.concatenate(motion_frequencies_hz)
        ascending = np.argsort(all_frequencies_hz)
        cumulative_power = np.cumsum(all_power[ascending])
        last_line = min(np.searchsorted(cumulative_power, MOVING_BAND_SHARE * cumulative_power[-1]), len(ascending) - 1)
        channel_ends_hz.append(float(all_frequencies_hz[ascending][last_line]))
    return max(channel_ends_hz)


def _compute_motion(
    record: Observed,
    measured: tuple[FloatArray, int],
    band: tuple[float, float],
    condition: FloatArray,
    channels: tuple[str, ...],
) -> Motion:
    """Compute the motion of one record. measured: samples (n, d) and the order of their time derivative; band: upper
    and lower end in Hz; condition: (n, q), standardised; channels: of the motion."""
    (samples, order), (band_hz, lowest_hz) = measured, band
    rate_hz, hold = record.recording.sample_rate_hz, record.recording.hold
    # Under a zero-order hold a command acts on average half a sample after the reading: the motion is advanced by that.
    advance_s = 0.5 / rate_hz if hold is Hold.ZERO_ORDER and not record.recording.meta.get("imposed") else 0.0
    if not np.isfinite(band_hz):
        return _make_untimed_motion(record, samples, condition, channels)
    position, velocity, acceleration = (
        _differentiate_in_band(samples, rate_hz, (band_hz, lowest_hz), derivative_order - order, advance_s)
        for derivative_order in range(3)
    )
    if is_free_motion(record.recording):
        # The command of a free motion was computed from its acceleration, so that no law may use the acceleration.
        acceleration = np.zeros_like(acceleration)
    return Motion(
        rate_hz, band_hz, max(int(rate_hz / (MOTION_OVERSAMPLED * band_hz)), 1), channels, order, position, velocity,
        acceleration, fill_gaps(record.command), condition, record.fit | record.choose, record.test, lowest_hz,
    )  # fmt: skip


def filter_band_pass(columns: FloatArray, rate_hz: float, band_hz: float, lowest_hz: float) -> FloatArray:
    """Filter columns (n, k) to the band from `lowest_hz` to `band_hz` without a phase shift; a low pass where
    `lowest_hz` is 0, which keeps the straight line between their ends; any other band excludes their mean."""
    return filter_spectrum(
        columns - columns.mean(axis=0) if lowest_hz > 0 else columns,
        lambda length: _tabulate_band_gain(length, rate_hz, band_hz, lowest_hz),
        subtract_line=lowest_hz == 0,
    )


@lru_cache(maxsize=8)  # the columns of all laws are filtered alike
def _tabulate_band_gain(length: int, rate_hz: float, band_hz: float, lowest_hz: float) -> FloatArray:
    """Compute (length // 2 + 1,): gain of the band-pass filter at the lines of a spectrum of `length` samples."""
    gain = _compute_band_gain(rfftfreq(length, 1 / rate_hz), band_hz, lowest_hz)
    gain.setflags(write=False)
    return gain


def _compute_band_gain(frequency_hz: FloatArray, band_hz: float, lowest_hz: float) -> FloatArray:
    """Compute (lines,): real gain of the band-pass filter; of the low-pass filter alone where `lowest_hz` is 0."""
    low_pass = compute_low_pass_gain(frequency_hz, band_hz)
    return np.asarray(low_pass * (1 - compute_low_pass_gain(frequency_hz, lowest_hz)) if lowest_hz > 0 else low_pass)


def _make_untimed_motion(
    record: Observed, samples: FloatArray, condition: FloatArray, channels: tuple[str, ...]
) -> Motion:
    """Make the motion of a recording without a time axis: positions, their change per sample as velocity, and zero
    acceleration."""
    return Motion(
        record.recording.sample_rate_hz, np.inf, 1, channels, 0, samples, np.gradient(samples, axis=0),
        np.zeros_like(samples), fill_gaps(record.command), condition, record.fit | record.choose, record.test,
    )  # fmt: skip


def _differentiate_in_band(
    samples: FloatArray, rate_hz: float, band: tuple[float, float], order: int, advance_s: float
) -> FloatArray:
    """Compute (n, k): the time derivative of order `order`; an integral where that is negative. band: upper and lower
    end in Hz. advance_s: time in s by which the result is advanced. Integrals of an acceleration, without its mean (as
    gravity), are high-pass filtered at the lower end of the band; the acceleration itself is not, like the force."""
    band_hz, lowest_hz = band
    end_line = compute_end_to_end_line(samples)
    slope = (samples[-1] - samples[0]) / max(len(samples) - 1, 1) * rate_hz

    def compute_gain(length: int) -> FloatArray:
        """Compute the frequency response (lines,) of differentiation, band limit and advance."""
        frequency_hz = rfftfreq(length, 1 / rate_hz)
        i_omega = 2j * np.pi * np.maximum(frequency_hz, 1e-12)  # above 0: a negative power of it is finite
        band_gain = _compute_band_gain(frequency_hz, band_hz, lowest_hz if order < 0 else 0.0)
        return np.asarray(band_gain * np.exp(i_omega * advance_s) * i_omega**order)

    if order < 0 and lowest_hz == 0:
        # The integral of a velocity is not periodic: it is summed in time instead of divided by i omega.
        smoothed = _differentiate_in_band(samples, rate_hz, band, 0, advance_s)
        return np.asarray(np.cumsum(smoothed, axis=0) / rate_hz)
    if order < 0:
        return filter_spectrum(samples - samples.mean(axis=0), compute_gain, subtract_line=False)
    derivative = filter_spectrum(samples - end_line, compute_gain, subtract_line=False)
    if order == 0:
        return np.asarray(derivative + end_line + slope * advance_s)
    return derivative + slope if order == 1 else derivative


def differentiate(samples: FloatArray, rate_hz: float, band_hz: float, order: int) -> FloatArray:
    """Compute (n, k): time derivative of order `order`, within 0 to `band_hz`, in the frequency domain."""
    return _differentiate_in_band(samples, rate_hz, (band_hz, 0.0), order, 0.0)


def _standardise_conditions(records: Sequence[Observed]) -> tuple[tuple[Condition, ...], list[FloatArray]]:
    """Standardise the conditions that vary to mean 0 and standard deviation 1 over all records. Returns them and their
    samples (n, q) per record; q is 0 where the records differ in their conditions, or none varies."""
    signals = [getattr(record.recording, "condition", None) for record in records]
    if len({None if signal is None else signal.channels for signal in signals}) > 1 or signals[0] is None:
        return (), [np.zeros((len(record.command), 0)) for record in records]
    filled_samples = [fill_gaps(signal.samples) for signal in signals if signal is not None]
    stacked = np.vstack(filled_samples)
    mean, deviation = stacked.mean(axis=0), stacked.std(axis=0)
    names = name_conditions(collect_channels(records[0].recording))
    varying = np.flatnonzero(deviation > 0)
    conditions = tuple(Condition(names[k], float(mean[k]), float(deviation[k])) for k in varying)
    return conditions, [(samples[:, varying] - mean[varying]) / deviation[varying] for samples in filled_samples]
