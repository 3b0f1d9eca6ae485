"""Source of samples from an accelerometer board on a serial line; opened by `sources`.

Reads bytes with pyserial and parses packets with `parser`. A separate thread calls `SerialSource.read`, so that waiting
for a silent line does not block the force loop.
"""

import time
from typing import Any, Protocol

from study.devices.accelerometer.parser import PacketParser
from study.devices.accelerometer.samples import PacketCounts, Samples
from study.errors import DeviceError

MAX_READ_BYTES = 4096
"""Maximum number of bytes per read: 256 packets of 16 bytes, 0.13 s at 2 kHz. Chosen."""

READ_TIMEOUT_S = 0.01
"""Timeout (s) of a read on a silent line. Chosen: short, so that the reading thread soon detects a close."""


class Port(Protocol):
    """An open serial line."""

    def read(self, size: int) -> bytes:
        """Read at most `size` bytes: fewer if fewer have arrived, none after a short timeout."""
        ...

    def close(self) -> None:
        """Close the line; may raise. Called once."""
        ...


class SerialSource:
    """A `SampleSource` that reads packets from an open serial line. Closing the source closes the line."""

    def __init__(self, port: Port) -> None:
        self._port, self._parser = port, PacketParser()

    @property
    def counts(self) -> PacketCounts:
        """Packets received and lost since the line was opened."""
        return self._parser.counts

    def read(self) -> tuple[Samples, float]:
        """Read new samples, and their time of arrival by `time.monotonic` (s); no samples on a silent line."""
        received_bytes = self._port.read(MAX_READ_BYTES)
        arrival_s = time.monotonic()
        return self._parser.feed(received_bytes), arrival_s

    def close(self) -> None:
        """Close the serial line; may raise. Called once."""
        self._port.close()


def open_serial(path: str, baud: int) -> SerialSource:
    """Open a board on a serial line. path: the port, such as /dev/ttyACM0; baud: bits per second. Raises `DeviceError`
    without pyserial, or where the port cannot be opened."""
    try:
        import serial
    except ImportError as error:
        raise DeviceError(
            "The accelerometer cannot be read",
            "The package pyserial is not installed.",
            "Install hapteq with its hardware extra: pip install '.[hardware]'.",
        ) from error
    try:
        return SerialSource(_SerialPort(serial.Serial(path, baud, timeout=READ_TIMEOUT_S, exclusive=True)))
    except (OSError, ValueError, OverflowError) as error:  # OverflowError: of a rate that no system has
        raise DeviceError(
            "The accelerometer cannot be opened",
            f"{path}: {error}.",
            "Plug it in, and name its port in the device's file; on Linux this account must be in the group dialout.",
        ) from error


class _SerialPort:
    """`Port` by pyserial, whose own `read(size)` would wait for all `size` bytes or the timeout: this class waits for
    the first byte only, then reads the bytes that are already in the buffer."""

    def __init__(self, serial_port: Any) -> None:
        self._serial_port = serial_port

    def read(self, size: int) -> bytes:
        """Read at most `size` bytes (`Port.read`)."""
        first_byte: bytes = self._serial_port.read(1)
        buffered_bytes = min(size - 1, self._serial_port.in_waiting)
        return first_byte + self._serial_port.read(buffered_bytes) if first_byte and buffered_bytes else first_byte

    def close(self) -> None:
        """Close the line (`Port.close`)."""
        self._serial_port.close()
