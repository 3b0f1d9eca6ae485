"""Positions, velocities, accelerations and forces from one part of a recording.

Derivatives are computed in the frequency domain: each spectral line is multiplied by (i omega)^order and low-pass
filtered. The upper end of the band is the highest frequency up to which white noise makes at most a hundredth of the
acceleration's mean square, because regression on a noisier acceleration would underestimate the mass by more (errors in
variables; Soderstrom, Automatica 43:939, 2007). Measured accelerations are integrated above a lower end of the band
only, below which noise would dominate the position (`band.py` computes both ends).
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.fft import irfft, rfft, rfftfreq

from analysis.diagnosis.balance.band import band_begin_hz, band_end_hz
from analysis.diagnosis.data.measured_motion import fill_gaps, is_quasi_static, is_read_as_free
from analysis.diagnosis.data.observed import Observed
from analysis.diagnosis.settings import MOTION_EDGE_PERIODS, MOTION_OVERSAMPLED, MOVING_BAND_SHARE
from analysis.diagnosis.types import Mask
from equalizer.effects.discovered_law import condition_names, law_channels
from equalizer.plant.mechanical_model import DERIVATIVE_OF_QUANTITY
from equalizer.signals.band_limited import low_pass_gain, odd_extension
from equalizer.signals.recording import Hold, Recording
from equalizer.signals.signal import FloatArray, Signal


class NoMotionError(ValueError):
    """The recording has no motion that a force balance could use."""


@dataclass(frozen=True, slots=True)
class Condition:
    """A recorded condition that changes within the recordings, such as a temperature, with its mean and spread there,
    in its own unit."""

    name: str
    """Name in a formula."""
    mean: float
    spread: float
    """Standard deviation."""


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """Motion and force in one part of a recording, in SI units; all arrays at the recording's rate. Position, velocity
    and acceleration, (n, d) each, are band-limited; force and conditions are not."""

    rate_hz: float
    """Sample rate in Hz."""
    band_hz: float
    """Upper end of the band in Hz; infinite without a time axis: then nothing is filtered, and accelerations are 0."""
    step: int
    """Decimation factor after filtering: every `step`-th sample is kept."""
    channels: tuple[str, ...]
    order: int
    """Order of the position's time derivative that was measured: 0, 1 or 2."""
    position: FloatArray
    """(n, d): as measured, or integrated: a velocity by summation from the first sample on, an acceleration in the
    frequency domain."""
    velocity: FloatArray
    acceleration: FloatArray
    force: FloatArray
    """(n, m): as commanded or measured."""
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
        """(kept samples, k): columns (n, k) filtered to the band and decimated by `step`."""
        if not np.isfinite(self.band_hz):
            return columns
        return self.band_pass(columns)[:: self.step]

    def band_pass(self, columns: FloatArray) -> FloatArray:
        """(n, k): columns filtered to the band, at the recording's rate."""
        return band_pass(columns, self.rate_hz, self.band_hz, self.lowest_hz)

    def valid_samples(self, mask: Mask) -> Mask:
        """(kept samples,): the samples of a mask (n,) that are not within a filter length of the part's ends."""
        edge = int(MOTION_EDGE_PERIODS * self.rate_hz / self.band_hz) + 1
        inside = np.zeros(len(mask), dtype=np.bool_)
        inside[edge : len(mask) - edge] = True
        return (mask & inside)[:: self.step]


def motion_signal(recording: Recording) -> Signal | None:
    """The channels of the lowest time derivative that was measured and varies: positions before velocities before
    accelerations; None without any."""
    found: list[tuple[int, Signal]] = []
    for signal in (recording.position, recording.response):
        if signal is None:
            continue
        orders = [DERIVATIVE_OF_QUANTITY.get(quantity) for quantity in signal.quantities]
        known = [order for order in orders if order is not None]
        if not known:
            continue
        lowest = min(known)
        places = [k for k, order in enumerate(orders) if order == lowest and _varies(signal.samples[:, k])]
        if places:
            found.append((lowest, signal.select_channels(places)))
    return min(found, key=lambda item: item[0])[1] if found else None


def _varies(samples: FloatArray) -> bool:
    """Whether the finite samples change."""
    known = samples[np.isfinite(samples)]
    return bool(len(known)) and float(np.ptp(known)) > 0


def motions_of(records: Sequence[Observed], band_hz: float | None = None) -> tuple[Motion, ...]:
    """One motion per record, with derivatives and forces. records: with the same channels, units and rate. band_hz:
    upper end of the band; None = the highest that the noise allows. Raises NoMotionError where there are no records, or
    a record contains no motion."""
    signals = [motion_signal(record.recording) for record in records]
    if not signals or any(signal is None for signal in signals):
        raise NoMotionError("no response is a position, velocity or acceleration")
    moved = [signal for signal in signals if signal is not None]
    order = DERIVATIVE_OF_QUANTITY[moved[0].quantities[0]]
    rate_hz = records[0].recording.sample_rate_hz
    filled = [fill_gaps(signal.samples) for signal in moved]
    untimed = any(is_quasi_static(record.recording) for record in records)
    if band_hz is None:
        band_hz = np.inf if untimed else band_end_hz(filled, rate_hz, order)
    lowest_hz = band_begin_hz(filled, rate_hz) if order == 2 and not untimed else 0.0
    known, conditions = _standardise_conditions(records)
    return tuple(
        replace(_motion(record, (samples, order), (band_hz, lowest_hz), condition, moved[0].channels), conditions=known)
        for record, samples, condition in zip(records, filled, conditions, strict=True)
    )


def motion_band_hz(motions: Sequence[Motion], columns: Iterable[int]) -> float:
    """Frequency in Hz below which `MOVING_BAND_SHARE` of a channel's mean square velocity lies, the highest over the
    channels; infinite without a time axis. columns: indices of the channels."""
    if not np.isfinite(motions[0].band_hz):
        return np.inf
    ends = []
    for column in columns:
        power, frequency_hz = [], []
        for motion in motions:
            speed = motion.velocity[:, column]
            power.append(np.abs(rfft(speed - speed.mean())) ** 2 / len(speed))
            frequency_hz.append(rfftfreq(len(speed), 1 / motion.rate_hz))
        every, where = np.concatenate(power), np.concatenate(frequency_hz)
        order = np.argsort(where)
        below = np.cumsum(every[order])
        ends.append(float(where[order][min(np.searchsorted(below, MOVING_BAND_SHARE * below[-1]), len(where) - 1)]))
    return max(ends)


def _motion(
    record: Observed,
    measured: tuple[FloatArray, int],
    band: tuple[float, float],
    condition: FloatArray,
    names: tuple[str, ...],
) -> Motion:
    """Motion of one record. measured: samples (n, d) and the order of their time derivative; band: upper and lower end
    in Hz; condition: (n, q), standardised; names: channels of the motion."""
    (samples, order), (band_hz, lowest_hz) = measured, band
    rate_hz, hold = record.recording.sample_rate_hz, record.recording.hold
    # Under a zero-order hold a command acts, in the mean, half a sample after the reading: the motion is shifted to it.
    early_s = 0.5 / rate_hz if hold is Hold.ZERO_ORDER and not record.recording.meta.get("imposed") else 0.0
    if not np.isfinite(band_hz):
        return _motion_without_clock(record, samples, condition, names)
    position, velocity, acceleration = (
        _derivative(samples, rate_hz, (band_hz, lowest_hz), wanted - order, early_s) for wanted in range(3)
    )
    if is_read_as_free(record.recording):
        # The command of a free motion was computed from its acceleration, so that no law may use the acceleration.
        acceleration = np.zeros_like(acceleration)
    return Motion(
        rate_hz, band_hz, max(int(rate_hz / (MOTION_OVERSAMPLED * band_hz)), 1), names, order, position, velocity,
        acceleration, fill_gaps(record.command), condition, record.fit | record.choose, record.test, lowest_hz,
    )  # fmt: skip


def band_pass(columns: FloatArray, rate_hz: float, band_hz: float, lowest_hz: float) -> FloatArray:
    """(n, k): columns band-pass filtered between `lowest_hz` and `band_hz` without a phase shift; low-pass filtered
    where `lowest_hz` is 0."""
    return filter_spectrum(columns, rate_hz, lambda f: _band_gain(f, band_hz, lowest_hz))


def _band_gain(frequency_hz: FloatArray, band_hz: float, lowest_hz: float) -> FloatArray:
    """(lines,): real gain of the band-pass filter, of the low-pass filter alone where `lowest_hz` is 0."""
    shaped = low_pass_gain(frequency_hz, band_hz)
    return np.asarray(shaped * (1 - low_pass_gain(frequency_hz, lowest_hz)) if lowest_hz > 0 else shaped)


def _motion_without_clock(
    record: Observed, samples: FloatArray, condition: FloatArray, names: tuple[str, ...]
) -> Motion:
    """Motion of a recording without a time axis: positions, their change per sample as velocity, and no
    acceleration."""
    return Motion(
        record.recording.sample_rate_hz, np.inf, 1, names, 0, samples, np.gradient(samples, axis=0),
        np.zeros_like(samples), fill_gaps(record.command), condition, record.fit | record.choose, record.test,
    )  # fmt: skip


def _derivative(
    samples: FloatArray, rate_hz: float, band: tuple[float, float], times: int, early_s: float
) -> FloatArray:
    """(n, k): the time derivative of order `times`; an integral where that is negative. band: upper and lower end in
    Hz. early_s: time in s by which the result is advanced. Integrals of an acceleration are high-pass filtered at the
    lower end of the band; the acceleration itself is not, like the force."""
    band_hz, lowest_hz = band
    line, slope = _end_to_end_line(samples, rate_hz)

    def gain(frequency_hz: FloatArray) -> FloatArray:
        turn = 2j * np.pi * np.maximum(frequency_hz, 1e-12)
        shaped = _band_gain(frequency_hz, band_hz, lowest_hz if times < 0 else 0.0)
        return np.asarray(shaped * np.exp(turn * early_s) * turn**times)

    if times < 0 and lowest_hz == 0:
        # The integral of a velocity is not periodic: it is summed in time instead of divided by i omega.
        smooth = _derivative(samples, rate_hz, band, 0, early_s)
        return np.asarray(np.cumsum(smooth, axis=0) / rate_hz)
    if times < 0:
        return filter_spectrum(samples, rate_hz, gain, straightened=False)
    bent = filter_spectrum(samples - line, rate_hz, gain, straightened=False)
    if times == 0:
        return bent + line + slope * early_s
    return bent + slope if times == 1 else bent


def low_pass_filter(samples: FloatArray, rate_hz: float, band_hz: float) -> FloatArray:
    """(n, k): samples low-pass filtered to `band_hz` in the frequency domain, with the line between their ends kept."""
    return filter_spectrum(samples, rate_hz, lambda f: low_pass_gain(f, band_hz))


def differentiate(samples: FloatArray, rate_hz: float, band_hz: float, times: int) -> FloatArray:
    """(n, k): time derivative of order `times`, within 0 to `band_hz`, computed in the frequency domain."""
    return _derivative(samples, rate_hz, (band_hz, 0.0), times, 0.0)


def filter_spectrum(samples: FloatArray, rate_hz: float, gain: object, straightened: bool = True) -> FloatArray:
    """(n, k): samples filtered in the frequency domain. gain: function of the frequencies in Hz (lines,) that returns
    the frequency response (lines,). Samples are continued beyond both ends by an odd extension. straightened: whether
    the line between the end points is removed before and added after filtering."""
    line = _end_to_end_line(samples, rate_hz)[0] if straightened else np.zeros_like(samples)
    whole = odd_extension(samples - line)
    spectrum = rfft(whole, axis=0)
    lines = rfftfreq(len(whole), 1 / rate_hz)
    return np.asarray(irfft(gain(lines)[:, None] * spectrum, len(whole), axis=0)[: len(samples)] + line)  # type: ignore[operator]


def _end_to_end_line(samples: FloatArray, rate_hz: float) -> tuple[FloatArray, FloatArray]:
    """The straight line from the first to the last sample, (n, k), and its slope per second, (k,)."""
    along = np.linspace(0.0, 1.0, len(samples))[:, None]
    line = (1 - along) * samples[0] + along * samples[-1]
    return np.asarray(line), np.asarray((samples[-1] - samples[0]) / max(len(samples) - 1, 1) * rate_hz)


def _standardise_conditions(records: Sequence[Observed]) -> tuple[tuple[Condition, ...], list[FloatArray]]:
    """The conditions that change, and their samples (n, q) per record, standardised to mean 0 and standard deviation 1
    over all records; none where the records differ in their conditions."""
    signals = [getattr(record.recording, "condition", None) for record in records]
    if len({None if signal is None else signal.channels for signal in signals}) > 1 or signals[0] is None:
        return (), [np.zeros((len(record.command), 0)) for record in records]
    filled = [fill_gaps(signal.samples) for signal in signals if signal is not None]
    whole = np.vstack(filled)
    mean, spread = whole.mean(axis=0), whole.std(axis=0)
    names = condition_names(law_channels(records[0].recording))
    varying = np.flatnonzero(spread > 0)
    known = tuple(Condition(names[k], float(mean[k]), float(spread[k])) for k in varying)
    return known, [(each[:, varying] - mean[varying]) / spread[varying] for each in filled]
