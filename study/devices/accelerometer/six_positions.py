"""Procedure of the six-position calibration: records the sensor at rest with each axis up and down.

The calibration itself (least squares under gravity) is in `calibration`; the result is the [accelerometer] table for
the laboratory's settings file.
"""

import time
from collections.abc import Callable

import numpy as np

from equalizer.signals.signal import FloatArray
from protocols.document.dumping import format_toml_text
from study.devices.accelerometer.calibration import GRAVITY_MPS2, POSITIONS, Calibration, calibrate
from study.devices.accelerometer.samples import SampleSource
from study.devices.accelerometer.sensor import make_silence_error
from study.devices.accelerometer.sources import has_volt_samples, open_source
from study.errors import DeviceError

AwaitPosition = Callable[[str, tuple[float, float, float] | None], None]
"""await_position(position, previous_mean): returns when the sensor lies in that position. previous_mean: mean raw
values of the three channels in the previous position, None for the first."""

REST_S = 2.0
"""Duration of the recording in each position (s): at 2 kHz 4000 samples, whose mean has a noise below 1 mg."""

SETTLE_S = 0.3
"""Time (s) after a change of position in which samples may still belong to the old one; they are discarded. Chosen."""

BACKLOG_SAMPLES, DRAIN_S = 200, 2.0
"""More than BACKLOG_SAMPLES samples in a single read come from a buffer and are old. They are discarded too, for at
most DRAIN_S (s) after `SETTLE_S`. Chosen: 200 samples are 0.1 s at 2 kHz."""

RANGE_G = 3.0
"""Guaranteed range of the ADXL335, in g (data sheet: ±3 g minimum); beyond it, a channel counts as clipped."""


def calibrate_in_six_positions(path: str, baud: int, await_position: AwaitPosition, rest_s: float | None = None) -> str:
    """Record all positions and return the [accelerometer] table, as TOML. path: port of the sensor, as in `sources`;
    baud: rate of a serial line (bit/s); rest_s: time per position (s), None = `REST_S`.

    Raises `DeviceError` where the port cannot be opened, no samples arrive, or the positions do not fit a linear
    sensor.
    """
    source = open_source(path, baud)
    try:
        calibration = calibrate(_record_positions(source, await_position, REST_S if rest_s is None else rest_s))
    except ValueError as error:
        raise DeviceError("The accelerometer was not calibrated", f"{error}.", "Do it again.") from error
    finally:
        source.close()
    return format_calibration_toml(calibration, path, baud)


def format_calibration_toml(calibration: Calibration, path: str, baud: int) -> str:
    """Format the [accelerometer] table for the laboratory's settings file. path: port of the sensor; baud: rate of a
    serial line (bit/s). Its raw_range holds the raw values for `RANGE_G` along any direction; counts are limited to 16
    bits."""
    half_range_raw = np.abs(calibration.sensitivity).sum(axis=1) * RANGE_G * GRAVITY_MPS2
    lowest_raw, highest_raw = (
        float((calibration.bias - half_range_raw).min()),
        float((calibration.bias + half_range_raw).max()),
    )
    count_range = f"[{max(0, round(lowest_raw))}, {min(65_535, round(highest_raw))}]"
    raw_range = _format_toml_numbers(np.array([lowest_raw, highest_raw])) if has_volt_samples(path) else count_range
    sensitivity_rows = ", ".join(_format_toml_numbers(row) for row in calibration.sensitivity)
    noise = ", ".join(f"{value:.3f}" for value in calibration.noise_mps2)
    return "\n".join(
        (
            "[accelerometer]",
            f"# Noise {noise} m/s2, cross-axis {calibration.cross_axis:.1%}, positions fit to "
            f"{calibration.residual_g:.3f} g.",
            f"port = {format_toml_text(path)}",
            f"baud = {baud}",
            f"bias = {_format_toml_numbers(calibration.bias)}",
            f"sensitivity = [{sensitivity_rows}]",
            f"raw_range = {raw_range}",
        )
    )


def _record_positions(source: SampleSource, await_position: AwaitPosition, rest_s: float) -> tuple[FloatArray, ...]:
    """Record raw samples, (n, 3) for each of `POSITIONS`. rest_s: time per position (s)."""
    recordings: list[FloatArray] = []
    for position in POSITIONS:
        x, y, z = recordings[-1].mean(axis=0).tolist() if recordings else (0.0, 0.0, 0.0)
        await_position(position, (x, y, z) if recordings else None)
        recordings.append(_record_position(source, rest_s))
    return tuple(recordings)


def _record_position(source: SampleSource, rest_s: float) -> FloatArray:
    """Record raw samples (n, 3) of one position for rest_s (s). Raises `DeviceError` where fewer than two arrive."""
    settled_at_s = time.monotonic() + SETTLE_S
    now_s, sample_count = time.monotonic(), 0
    # Discard samples of the previous position: some are in the line's buffer, and where that is full, the board
    # itself holds more.
    while now_s < settled_at_s or (sample_count > BACKLOG_SAMPLES and now_s < settled_at_s + DRAIN_S):
        old_samples, now_s = source.read()
        sample_count = len(old_samples)
    initial_spoiled_bytes, sample_blocks = source.counts.spoiled_bytes, [np.zeros((0, 3))]
    end_s = time.monotonic() + rest_s
    while time.monotonic() < end_s:
        sample_blocks.append(source.read()[0].raw.astype(float))
    samples = np.concatenate(sample_blocks)
    if len(samples) < 2:
        raise make_silence_error(rest_s, source.counts.spoiled_bytes - initial_spoiled_bytes)
    return samples


def _format_toml_numbers(row: FloatArray) -> str:
    """Format a row (n,) as a TOML array: a number of magnitude 100 or more (counts of 16 bits) with four decimals, else
    seven (volts)."""
    return f"[{', '.join(f'{value:.4f}' if abs(value) >= 100 else f'{value:.7f}' for value in row)}]"
