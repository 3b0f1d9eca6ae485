"""Accelerometer on a serial line: a thread reads it, so that the newest sample is available at any time."""

import contextlib
import threading
import time
from typing import Any, Protocol

import numpy as np

from equalizer.signals.signal import FloatArray
from study.devices.accelerometer.calibration import Calibration
from study.devices.accelerometer.parser import Counts, PacketParser
from study.errors import DeviceError

FRESH_S = 0.05
"""Age up to which the newest sample is used: fifty ticks, more than a busy computer delays a thread."""

ZEROING_S = 0.5
"""Time at rest, on opening, over which the reading is averaged and then subtracted: gravity, and the drift of the bias
since the calibration."""

AT_ONCE = 4096
"""Bytes: 0.1 s at 2 kHz."""

WAIT_S = 0.01
"""Timeout for a byte on a silent line, and so the longest time until the thread notices `close`."""


class Port(Protocol):
    """An open serial line."""

    def read(self, size: int) -> bytes:
        """Read at most `size` bytes, with a short timeout: fewer or none if no more came."""
        ...

    def close(self) -> None: ...


class SerialAccelerometer:
    """raw_range: the lowest and the highest raw value that are within the sensor's range."""

    def __init__(self, port: Port, calibration: Calibration, raw_range: tuple[int, int]) -> None:
        self._port, self._calibration, self._range = port, calibration, raw_range
        self._parser = PacketParser()
        self._newest: tuple[float, FloatArray, bool] | None = None
        self._rest_mps2 = np.zeros(3)
        self._closed = threading.Event()
        self._thread = threading.Thread(target=self._read, name="accelerometer", daemon=True)
        self._thread.start()

    @property
    def counts(self) -> Counts:
        return self._parser.counts

    def zero(self, seconds: float = ZEROING_S) -> None:
        """Zero the reading: the present one, at rest, is subtracted from now on. Raises `DeviceError` without a
        reading."""
        readings = []
        until_s = time.monotonic() + seconds
        while time.monotonic() < until_s:
            time.sleep(seconds / 100)
            if (newest := self._newest) is not None:
                readings.append(newest[1])
        if not readings:
            raise DeviceError(
                "The accelerometer is silent",
                f"Within {seconds:g} s no whole packet came ({self.counts.spoiled_bytes} bytes that are none).",
                "Check its cable, the port and the baud rate, and that its firmware runs.",
            )
        self._rest_mps2 = np.mean(readings, axis=0)

    def latest(self) -> tuple[FloatArray, bool]:
        newest = self._newest
        if newest is None or time.monotonic() - newest[0] > FRESH_S:
            return np.full(3, np.nan), False
        return newest[1] - self._rest_mps2, newest[2]

    def close(self) -> None:
        self._closed.set()
        self._thread.join(1.0)
        with contextlib.suppress(Exception):
            self._port.close()

    def _read(self) -> None:
        """A line that breaks leaves no fresh sample: that is how it is noticed."""
        with contextlib.suppress(Exception):
            while not self._closed.is_set():
                samples = self._parser.feed(self._port.read(AT_ONCE))
                if len(samples):
                    raw = samples.raw[-1]
                    clipped = bool((raw <= self._range[0]).any() or (raw >= self._range[1]).any())
                    self._newest = time.monotonic(), self._calibration.acceleration(raw.astype(float)), clipped


def open_serial(path: str, baud: int) -> Port:
    """Raises `DeviceError`."""
    try:
        import serial
    except ImportError as error:
        raise DeviceError(
            "The accelerometer cannot be read",
            "The package pyserial is not installed.",
            "Install hapteq with its hardware extra: pip install '.[hardware]'.",
        ) from error
    try:
        return _SerialPort(serial.Serial(path, baud, timeout=WAIT_S, exclusive=True))
    except (OSError, ValueError) as error:
        raise DeviceError(
            "The accelerometer cannot be opened",
            f"{path}: {error}.",
            "Plug it in, and name its port in the device's file; on Linux this account must be in the group dialout.",
        ) from error


class _SerialPort:
    """What is there is read at once; where nothing is, a byte is waited for. pyserial would wait for all of them."""

    def __init__(self, line: Any) -> None:
        self._line = line

    def read(self, size: int) -> bytes:
        first: bytes = self._line.read(1)
        waiting = min(size - 1, self._line.in_waiting)
        return first + self._line.read(waiting) if first and waiting else first

    def close(self) -> None:
        self._line.close()
