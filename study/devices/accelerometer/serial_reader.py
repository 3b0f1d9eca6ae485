"""The accelerometer as the rig wants it: a thread reads the serial line, and the newest sample is there at any time."""

import contextlib
import threading
import time
from typing import Any, Protocol

import numpy as np

from equalizer.signals.signal import FloatArray
from study.devices.accelerometer.calibration import Calibration
from study.devices.accelerometer.newest_sample import SENSED, NewestSample
from study.devices.accelerometer.parser import Counts, PacketParser
from study.errors import DeviceError

ZEROING_S = 0.5
"""At rest, when it is opened: gravity, and the drift of the bias since the calibration."""

AT_ONCE = 4096
"""Bytes: 0.1 s at 2 kHz."""

WAIT_S = 0.01
"""For a byte, on a silent line: so long until a reader hears that it is to end."""


class Port(Protocol):
    """An open serial line."""

    def read(self, size: int) -> bytes:
        """At most size bytes, soon: fewer or none where no more came."""
        ...

    def close(self) -> None: ...


class SerialAccelerometer:
    """raw_range: the lowest and the highest raw value that are within the sensor's range."""

    def __init__(self, port: Port, calibration: Calibration, raw_range: tuple[int, int]) -> None:
        self._port, self._calibration, self._range = port, calibration, raw_range
        self._parser = PacketParser()
        self._samples = NewestSample()
        self._closed = threading.Event()
        self._thread = threading.Thread(target=self._read, name="accelerometer", daemon=True)
        self._thread.start()

    @property
    def counts(self) -> Counts:
        return self._parser.counts

    def zero(self, seconds: float = ZEROING_S) -> None:
        """What it reads now, at rest, counts as none from now on. Raises `DeviceError` where it reads nothing."""
        readings = []
        until_s = time.monotonic() + seconds
        while time.monotonic() < until_s:
            time.sleep(seconds / 100)
            if (newest := self._samples.latest()) is not None:
                readings.append(newest[SENSED : SENSED + 3])
        if not readings:
            raise DeviceError(
                "The accelerometer is silent",
                f"Within {seconds:g} s no whole packet came ({self.counts.spoiled_bytes} bytes that are none).",
                "Check its cable, the port and the baud rate, and that its firmware runs.",
            )
        self._samples.count_as_none(np.mean(readings, axis=0))

    @property
    def samples(self) -> FloatArray:
        """Where compiled code reads what `latest` tells."""
        return self._samples.rows

    def latest(self) -> tuple[FloatArray, bool]:
        return self._samples.fresh(time.monotonic())

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
                    self._samples.put(time.monotonic(), self._calibration.acceleration(raw.astype(float)), clipped)


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
