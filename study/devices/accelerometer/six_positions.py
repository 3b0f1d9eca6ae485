"""The six-position calibration at a table: lay the sensor down, wait, turn it; then what the lab's file must say."""

import time
from collections.abc import Callable

import numpy as np

from equalizer.signals.signal import FloatArray
from study.devices.accelerometer.calibration import GRAVITY_MPS2, POSITIONS, Calibration, calibrate
from study.devices.accelerometer.parser import PacketParser
from study.devices.accelerometer.serial_reader import AT_ONCE, Port, open_serial
from study.errors import DeviceError

REST_S = 2.0
"""Duration in each position: at 2 kHz the mean of 4000 samples, within 1 mg of noise."""

SETTLE_S = 0.3
"""Time after a position changes in which samples may still belong to the old one."""

RANGE_G = 3.0
"""Guaranteed range of the ADXL335; beyond it, a channel counts as clipped."""


def calibrate_on_table(path: str, baud: int, before_each: Callable[[str], None], rest_s: float = REST_S) -> str:
    """`before_each(position)` returns when the sensor lies there. The table of the lab's file, TOML.

    Raises `DeviceError` where nothing comes, or the positions do not fit a sensor.
    """
    port = open_serial(path, baud)
    try:
        calibration = calibrate(tuple(_record_position(port, position, before_each, rest_s) for position in POSITIONS))
    except ValueError as error:
        raise DeviceError("The accelerometer was not calibrated", f"{error}.", "Do it again.") from error
    finally:
        port.close()
    return calibration_toml(calibration, path, baud)


def calibration_toml(calibration: Calibration, path: str, baud: int) -> str:
    reach = np.abs(calibration.sensitivity).sum(axis=1) * RANGE_G * GRAVITY_MPS2
    lowest, highest = float((calibration.bias - reach).min()), float((calibration.bias + reach).max())
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
            f"raw_range = [{max(0, round(lowest))}, {min(65_535, round(highest))}]",
        )
    )


def _record_position(port: Port, position: str, before_each: Callable[[str], None], rest_s: float) -> FloatArray:
    """Raw samples (n, 3)."""
    before_each(position)
    settled_s = time.monotonic() + SETTLE_S
    while len(port.read(AT_ONCE)) == AT_ONCE or time.monotonic() < settled_s:
        pass  # of before: the line holds some, and the board waits with more where that is full
    parser, found = PacketParser(), [np.zeros((0, 3))]
    until_s = time.monotonic() + rest_s
    while time.monotonic() < until_s:
        found.append(parser.feed(port.read(AT_ONCE)).raw.astype(float))
    samples = np.concatenate(found)
    if len(samples) < 2:
        raise DeviceError(
            "The accelerometer is silent",
            f"Within {rest_s:g} s no whole packet came ({parser.counts.spoiled_bytes} bytes that are none).",
            "Check its cable, the port and the baud rate, and that its firmware runs.",
        )
    return samples


def _numbers(row: FloatArray) -> str:
    return f"[{', '.join(f'{value:.4f}' for value in row)}]"
