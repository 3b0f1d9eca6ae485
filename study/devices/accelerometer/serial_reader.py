"""A board on a serial line as a source of samples."""

import time
from typing import Any, Protocol

from study.devices.accelerometer.parser import PacketParser
from study.devices.accelerometer.samples import Counts, Samples
from study.errors import DeviceError

AT_ONCE = 4096
"""Bytes: 0.1 s at 2 kHz."""

WAIT_S = 0.01
"""Timeout for a byte on a silent line, and so the longest time until the thread notices `close`."""


class Port(Protocol):
    """An open serial line."""

    def read(self, size: int) -> bytes:
        """Read at most `size` bytes, with a short timeout: fewer or none if no more came."""
        ...

    def close(self) -> None:
        """May raise; called once."""
        ...


class SerialSource:
    """A `Source` that parses the bytes of an open serial line. Closing it closes the line."""

    def __init__(self, port: Port) -> None:
        self._port, self._parser = port, PacketParser()

    @property
    def counts(self) -> Counts:
        return self._parser.counts

    def read(self) -> tuple[Samples, float]:
        data = self._port.read(AT_ONCE)
        arrived_s = time.monotonic()
        return self._parser.feed(data), arrived_s

    def close(self) -> None:
        self._port.close()


def open_serial(path: str, baud: int) -> SerialSource:
    """Open a board on a serial line. Raises `DeviceError`."""
    try:
        import serial
    except ImportError as error:
        raise DeviceError(
            "The accelerometer cannot be read",
            "The package pyserial is not installed.",
            "Install hapteq with its hardware extra: pip install '.[hardware]'.",
        ) from error
    try:
        return SerialSource(_SerialPort(serial.Serial(path, baud, timeout=WAIT_S, exclusive=True)))
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
