"""Accelerometer with its own clock, as a device driver uses it.

A thread reads the source and fills two buffers: the newest sample, which the control loop reads at every tick without
waiting (`newest_sample`), and the samples of the last minutes (`history`), from which the accelerations at the ticks of
a recording are computed afterwards (`clock_fit`, `tick_resampling`). Opened by `study.devices.force_dimension.lab`,
used by `force_dimension.rig`.
"""

import contextlib
import math
import threading
import time

import numpy as np

from equalizer.signals.signal import FloatArray
from study.devices.accelerometer.calibration import Calibration
from study.devices.accelerometer.clock_fit import ClockFit
from study.devices.accelerometer.history import SampleHistory
from study.devices.accelerometer.newest_sample import NewestSample
from study.devices.accelerometer.samples import PacketCounts, SampleSource
from study.devices.accelerometer.tick_resampling import HALF_LENGTH_PERIODS, ResampledValues, fit_and_resample
from study.devices.rig import SensedAcceleration
from study.errors import DeviceError
from study.session.facts.sensor_facts import SensorFacts

ZEROING_S = 0.5
"""Duration (s) of the measurement at rest when the sensor is opened. Its mean is subtracted from all readings: gravity,
and the drift of the bias since the calibration. Chosen: 1000 samples at 2 kHz."""

CLOCK_FIT_S = 120.0
"""Time (s) before a recording from which sample arrivals are included in the fit of the sensor's clock, besides those
of the recording itself: long enough for 1 ppm, short enough for a nearly constant rate of a quartz that warms up."""

CLIPPED_FOR_S = 0.002
"""Time (s) for which a sample at its limit also marks later ones as clipped: the control loop, which only reads the
newest sample, sees it although another one arrives before the next tick. Chosen: two ticks at 1 kHz."""

LATENESS_S = 0.05
"""Wait (s) after the last tick for samples that are still on their way, in addition to half the length of the low-pass
filter. Chosen: the longest delay of a packet that `sensor_findings.MAX_DELAY_S` accepts."""


class Accelerometer:
    """An accelerometer with its own clock: the newest sample at any time, and resampled samples after a recording.
    raw_range: lowest and highest raw value; a sample at or beyond either counts as clipped. The constructor starts the
    thread that reads the source."""

    def __init__(self, source: SampleSource, calibration: Calibration, raw_range: tuple[float, float]) -> None:
        self._source, self._calibration, self._raw_range_limits = source, calibration, raw_range
        self._history = SampleHistory()
        self._newest = NewestSample()
        self._rest_mps2 = np.zeros(3)
        self._close_requested = threading.Event()
        self._thread = threading.Thread(target=self._run_reading_loop, name="accelerometer", daemon=True)
        self._thread.start()

    @property
    def counts(self) -> PacketCounts:
        """Packets and lost packets since the source was opened."""
        return self._source.counts

    def zero(self, seconds: float = ZEROING_S) -> None:
        """Measure for `seconds` at rest, and subtract the mean from all later readings. Raises `DeviceError` where no
        sample arrives."""
        start_s = time.monotonic()
        time.sleep(seconds)
        raw_at_rest = self._history.select_interval(start_s, time.monotonic()).raw
        if not len(raw_at_rest):
            raise make_silence_error(seconds, self.counts.spoiled_bytes)
        self._rest_mps2 = self._calibration.to_acceleration(raw_at_rest.mean(axis=0))
        self._newest.set_rest(self._rest_mps2)

    @property
    def samples(self) -> FloatArray:
        """Array `NewestSample.rows`, from which compiled code reads what `read_latest` returns."""
        return self._newest.rows

    def read_latest(self) -> tuple[FloatArray, bool]:
        """Read the newest acceleration, (3,), m/s², less the reading at rest, NaN without a sample younger than
        `newest_sample.MAX_AGE_S`; and whether a channel was at its limit in a sample that arrived with it, or up to
        `CLIPPED_FOR_S` before. May be called from any thread."""
        return self._newest.read_zeroed(time.monotonic())

    def sensed(self, since_s: float, tick_s: FloatArray, rate_hz: float) -> SensedAcceleration:
        """Compute the accelerations at the ticks of a recording, as `study.devices.rig.AsynchronousAccelerometer`
        defines it. Waits until the samples after the last tick have arrived. Without ticks: no accelerations, and facts
        about the samples since since_s."""
        if len(tick_s):
            time.sleep(max(0.0, tick_s[-1] + HALF_LENGTH_PERIODS / rate_hz + LATENESS_S - time.monotonic()))
        resampled = self._resample_to_ticks(tick_s, rate_hz) if len(tick_s) else ResampledValues(np.zeros((0, 3)), None)
        packet_counts = self._history.count_since(since_s)
        return SensedAcceleration(resampled.values, _make_sensor_facts(packet_counts, resampled.values, resampled.fit))

    def measure_rest(self, seconds: float) -> tuple[SensorFacts, FloatArray, float]:
        """Measure the last `seconds`, during which the sensor was at rest. Returns facts; the standard deviation of
        each axis (3,), m/s², NaN without samples; samples per second. The clock is fitted as for a tick at this
        moment."""
        now_s = time.monotonic()
        interval_samples = self._history.select_interval(now_s - seconds, now_s)
        noise_mps2 = (
            self._calibration.to_acceleration(interval_samples.raw).std(axis=0)
            if len(interval_samples.raw)
            else np.full(3, np.nan)
        )
        clock_fit = self._resample_to_ticks(np.array([now_s]), 1000.0).fit
        return (
            _make_sensor_facts(self._history.count_since(now_s - seconds), np.zeros((0, 3)), clock_fit),
            noise_mps2,
            len(interval_samples.raw) / seconds,
        )

    def close(self) -> None:
        """Stop reading and close the source. Never raises; waits at most 1 s for the reading thread."""
        self._close_requested.set()
        self._thread.join(1.0)
        with contextlib.suppress(Exception):
            self._source.close()

    def _resample_to_ticks(self, tick_s: FloatArray, rate_hz: float) -> ResampledValues:
        """Compute the accelerations at the ticks (k, 3), m/s², less the reading at rest, and the fit of the clock.
        tick_s: (k,), at least one, s, by the monotonic clock; rate_hz: rate of the ticks."""
        arrived_samples = self._history.select_interval(tick_s[0] - CLOCK_FIT_S, time.monotonic())
        accelerations_mps2 = self._calibration.to_acceleration(arrived_samples.raw) - self._rest_mps2
        return fit_and_resample(arrived_samples, accelerations_mps2, tick_s, rate_hz)

    def _run_reading_loop(self) -> None:
        """Read the source until it is closed; the body of the reading thread. An error of the source ends it; readers
        detect that by the age of the newest sample."""
        clipped_s = -math.inf
        with contextlib.suppress(Exception):
            while not self._close_requested.is_set():
                samples, arrived_s = self._source.read()
                if len(samples):
                    if ((samples.raw <= self._raw_range_limits[0]) | (samples.raw >= self._raw_range_limits[1])).any():
                        clipped_s = arrived_s
                    acceleration_mps2 = self._calibration.to_acceleration(samples.raw[-1].astype(float))
                    self._newest.add_sample(arrived_s, acceleration_mps2, arrived_s - clipped_s <= CLIPPED_FOR_S)
                    self._history.add(samples, arrived_s, self._source.counts)


def make_silence_error(seconds: float, spoiled_bytes: int) -> DeviceError:
    """Make the error for a sensor that sent no complete packet within `seconds`. spoiled_bytes: number of received
    bytes that belong to no packet."""
    return DeviceError(
        "The accelerometer is silent",
        f"Within {seconds:g} s no whole packet came ({spoiled_bytes} bytes that belong to none).",
        "Another device or another firmware sends there, or the baud rate is wrong: check the port, flash the board."
        if spoiled_bytes
        else "Check its cable and the port, and that the board runs its firmware (docs/hardware.md).",
    )


def _make_sensor_facts(counts: PacketCounts, resampled: FloatArray, clock_fit: ClockFit | None) -> SensorFacts:
    """Make the facts for the log. counts: of the interval; resampled: accelerations at the ticks, (k, 3), NaN where
    unknown; clock_fit: fit of the sensor's clock, None where none was possible."""
    return SensorFacts(
        packets=counts.packets,
        lost=counts.lost,
        spoiled_bytes=counts.spoiled_bytes,
        restarts=counts.restarts,
        ticks=len(resampled),
        unplaced_ticks=int(np.isnan(resampled).any(axis=1).sum()),
        drift_ppm=clock_fit.drift_ppm if clock_fit is not None else None,
        longest_delay_s=clock_fit.longest_delay_s if clock_fit is not None else None,
    )
