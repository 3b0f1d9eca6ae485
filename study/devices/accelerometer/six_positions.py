"""Six-position calibration at a table: lay the sensor down, wait, turn it; at the end, the text for the lab's file."""

import time
from collections.abc import Callable

import numpy as np

from equalizer.signals.signal import FloatArray
from study.devices.accelerometer.calibration import GRAVITY_MPS2, POSITIONS, Calibration, calibrate
from study.devices.accelerometer.samples import Source
from study.devices.accelerometer.sensor import silent
from study.devices.accelerometer.sources import is_volts, open_source
from study.errors import DeviceError

BeforeEach = Callable[[str, tuple[float, float, float] | None], None]
"""before_each(position, heard): returns when the sensor lies there. heard: the mean raw values in the position before,
None for the first."""

REST_S = 2.0
"""Duration in each position: at 2 kHz the mean of 4000 samples, within 1 mg of noise."""

SETTLE_S = 0.3
"""Time after a position changes in which samples may still belong to the old one."""

MANY, DRAIN_S = 200, 2.0
"""Samples that come at once are old ones, which are let go by for so long at the most."""

RANGE_G = 3.0
"""Guaranteed range of the ADXL335; beyond it, a channel counts as clipped."""


def calibrate_on_table(path: str, baud: int, before_each: BeforeEach, rest_s: float | None = None) -> str:
    """The table of the lab's file, TOML. rest_s: `REST_S`.

    Raises `DeviceError` where nothing comes, or the positions do not fit a sensor.
    """
    source = open_source(path, baud)
    try:
        calibration = calibrate(_record_positions(source, before_each, REST_S if rest_s is None else rest_s))
    except ValueError as error:
        raise DeviceError("The accelerometer was not calibrated", f"{error}.", "Do it again.") from error
    finally:
        source.close()
    return calibration_toml(calibration, path, baud)


def calibration_toml(calibration: Calibration, path: str, baud: int) -> str:
    """The [accelerometer] table for the lab's settings file. path: port of the board; baud: its rate."""
    reach = np.abs(calibration.sensitivity).sum(axis=1) * RANGE_G * GRAVITY_MPS2
    lowest, highest = float((calibration.bias - reach).min()), float((calibration.bias + reach).max())
    within = f"[{max(0, round(lowest))}, {min(65_535, round(highest))}]"
    raw_range = _numbers(np.array([lowest, highest])) if is_volts(path) else within
    rows = ", ".join(_numbers(row) for row in calibration.sensitivity)
    noise = ", ".join(f"{value:.3f}" for value in calibration.noise_mps2)
    return "\n".join(
        (
            "[accelerometer]",
            f"# Noise {noise} m/s2, cross-axis {calibration.cross_axis:.1%}, positions fit to "
            f"{calibration.residual_g:.3f} g.",
            f'port = "{path}"',
            f"baud = {baud}",
            f"bias = {_numbers(calibration.bias)}",
            f"sensitivity = [{rows}]",
            f"raw_range = {raw_range}",
        )
    )


def _record_positions(source: Source, before_each: BeforeEach, rest_s: float) -> tuple[FloatArray, ...]:
    """Raw samples, (n, 3) each."""
    found: list[FloatArray] = []
    for position in POSITIONS:
        x, y, z = found[-1].mean(axis=0).tolist() if found else (0.0, 0.0, 0.0)
        before_each(position, (x, y, z) if found else None)
        found.append(_record_position(source, rest_s))
    return tuple(found)


def _record_position(source: Source, rest_s: float) -> FloatArray:
    """Raw samples (n, 3)."""
    settled_s = time.monotonic() + SETTLE_S
    now_s, came = time.monotonic(), 0
    # Of before: the line holds some, and the board waits with more where that is full.
    while now_s < settled_s or (came > MANY and now_s < settled_s + DRAIN_S):
        samples_of_before, now_s = source.read()
        came = len(samples_of_before)
    spoiled, found = source.counts.spoiled_bytes, [np.zeros((0, 3))]
    until_s = time.monotonic() + rest_s
    while time.monotonic() < until_s:
        found.append(source.read()[0].raw.astype(float))
    samples = np.concatenate(found)
    if len(samples) < 2:
        raise silent(rest_s, source.counts.spoiled_bytes - spoiled)
    return samples


def _numbers(row: FloatArray) -> str:
    """Volts have few digits before the point, counts of 16 bits many."""
    return f"[{', '.join(f'{value:.4f}' if abs(value) >= 100 else f'{value:.7f}' for value in row)}]"
