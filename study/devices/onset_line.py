"""Trigger pulse at the onset of each trial's force, for an external recorder (EEG, EMG, a camera).

The pulse is a byte or a control line (DTR, RTS) of a serial port, or the data lines of a parallel port; `Line` is their
common interface. A line that cannot begin a pulse does not interrupt a trial: the pulse is reported as lost
(`Pulse.at_s` is None), and the next request opens the line again. Begin at `open_onset_line`.
"""

import contextlib
import sys
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import Annotated, Any, Literal, Protocol

from pydantic import Field
from pydantic.dataclasses import dataclass as checked_dataclass

from protocols.definition.staircase_rule import STRICT
from study.errors import DeviceError

PULSE_TIMEOUT_S = 0.05
"""Timeout of a pulse (s). Chosen: a working line needs well below a millisecond."""

CLAIM_PORT, WRITE_DATA, RELEASE_PORT = 0x708B, 0x40017086, 0x708C
"""Requests (ioctl) of Linux' parallel port driver: PPCLAIM, PPWDATA and PPRELEASE of linux/ppdev.h."""


class Line(Protocol):
    """Interface of an open line. Every call may raise OSError, as pyserial does where the hardware is missing."""

    def raise_level(self) -> None:
        """Begin the pulse: set the control line or the data lines, or send the byte."""
        ...

    def lower_level(self) -> None:
        """End the pulse: reset the control line or the data lines, or send a zero byte."""
        ...

    def close(self) -> None:
        """Close the port."""
        ...


@dataclass(frozen=True, slots=True)
class Pulse:
    """Result of a request for a trigger pulse."""

    line: str
    """Description of the line."""
    at_s: float | None
    """Time at which the driver had accepted the pulse, by this process's monotonic clock (s); None: it may not have
    been sent."""
    trouble: str = ""
    """Reason for which the pulse is lost; empty where it was sent."""


@checked_dataclass(frozen=True, config=STRICT)
class PulseSettings:
    """Table `[pulse]` of the lab's file: kind of line, port and pulse."""

    kind: Literal["serial-byte", "serial-dtr", "serial-rts", "parallel"]
    """A byte or a control line of a serial port, or the data lines of a parallel port."""
    port: str
    """Such as /dev/ttyUSB0 or COM3 (serial), /dev/parport0 (parallel)."""
    code: Annotated[int, Field(ge=1, le=255)] = 1
    """Byte that is sent, or value of the data lines of a parallel port; not used for a control line."""
    width_s: Annotated[float, Field(gt=0, le=0.1)] = 0.005
    """Duration of the pulse (s), after which the byte 0 is sent or the line is lowered."""
    baud: Annotated[int, Field(gt=0)] = 115_200
    """Baud rate of a serial port (bit/s)."""

    @property
    def description(self) -> str:
        """Description of the line for the log."""
        names_by_kind = {"serial-byte": f"byte {self.code}", "serial-dtr": "DTR", "serial-rts": "RTS"}
        return f"{names_by_kind.get(self.kind, f'data lines {self.code}')} of {self.port}"


class OnsetLine:
    """Sends trigger pulses through a line. Only a separate thread calls the line, so that `send_pulse` raises no
    exception of a driver and waits at most `PULSE_TIMEOUT_S`.

    open_line: opens the line; may raise any exception. line: the open line; None: the first pulse opens it."""

    def __init__(
        self, settings: PulseSettings, open_line: Callable[[PulseSettings], Line], line: Line | None = None
    ) -> None:
        self._settings = settings
        self._open_line = open_line
        self._line = line
        self._requests: SimpleQueue[SimpleQueue[Pulse] | None] = SimpleQueue()
        self._pulse_lock = threading.Lock()
        self._thread = threading.Thread(target=self._run_thread, name="onset line", daemon=True)
        self._thread.start()

    def send_pulse(self) -> Pulse:
        """Send a pulse, and wait at most `PULSE_TIMEOUT_S` until the driver has accepted it. A lost pulse states its
        reason."""
        if self._pulse_lock.locked():
            return self._make_lost_pulse("the previous pulse has not been finished")
        reply_queue: SimpleQueue[Pulse] = SimpleQueue()
        self._requests.put(reply_queue)
        try:
            return reply_queue.get(timeout=PULSE_TIMEOUT_S)
        except Empty:
            return self._make_lost_pulse(f"the line accepted none within {1000 * PULSE_TIMEOUT_S:g} ms")

    def close(self) -> None:
        """Lower and close the line; waits at most 1 s (chosen) for its thread. Never raises."""
        self._requests.put(None)
        self._thread.join(1.0)

    def _run_thread(self) -> None:
        """Send the requested pulses until `close`, then close the line."""
        while (reply_queue := self._requests.get()) is not None:
            with self._pulse_lock:
                self._play_pulse(reply_queue)
        self._close_line()

    def _play_pulse(self, reply_queue: SimpleQueue[Pulse]) -> None:
        """Open the line if needed, raise it, put the result into `reply_queue`, and lower it after `width_s` (s). A
        line that does not begin the pulse is closed."""
        try:
            self._line = self._line or self._open_line(self._settings)
            self._line.raise_level()
        except Exception as error:  # noqa: BLE001 - a trial goes on without its pulse for any error of a driver
            reply_queue.put(self._make_lost_pulse(str(error) or type(error).__name__))
            self._close_line()
            return
        reply_queue.put(Pulse(self._settings.description, time.monotonic()))
        time.sleep(self._settings.width_s)
        with contextlib.suppress(Exception):  # a failure shows at the next pulse
            self._line.lower_level()

    def _close_line(self) -> None:
        """Lower and close the line, if it is open, and ignore errors."""
        line, self._line = self._line, None
        if line is not None:
            for close_step in (line.lower_level, line.close):
                with contextlib.suppress(Exception):
                    close_step()

    def _make_lost_pulse(self, trouble: str) -> Pulse:
        """Make the result for a pulse that may not have been sent. trouble: the reason."""
        return Pulse(self._settings.description, None, trouble)


def open_onset_line(settings: PulseSettings) -> OnsetLine:
    """Open the line before a session, because opening resets some boards, which then accept no byte for a second or
    two. Raises `DeviceError` for a line that cannot be opened."""
    try:
        line = open_port(settings)
    except (OSError, ValueError) as error:
        raise DeviceError(
            "The line for onset pulses cannot be opened",
            f"{settings.description}: {error}.",
            "Plug it in, or remove [pulse] from the device's file (docs/hardware.md).",
        ) from error
    return OnsetLine(settings, open_port, line)


def open_port(settings: PulseSettings) -> Line:
    """Open the serial or parallel line. Raises OSError, ValueError, and `DeviceError` where pyserial is missing."""
    if settings.kind == "parallel":
        return _ParallelPort(settings)
    try:
        import serial
    except ImportError as error:
        raise DeviceError(
            "The line for onset pulses cannot be opened",
            "The package pyserial is not installed.",
            "Install hapteq with its hardware extra: pip install '.[hardware]'.",
        ) from error
    line = serial.Serial(baudrate=settings.baud, write_timeout=PULSE_TIMEOUT_S, exclusive=True)
    if settings.kind != "serial-byte":
        line.dtr = line.rts = False  # before `open`, which would otherwise send a pulse
    line.port = settings.port
    line.open()
    return (
        _SerialBytePort(line, settings.code)
        if settings.kind == "serial-byte"
        else _SerialControlLine(line, settings.kind)
    )


class _SerialBytePort:
    """A byte on an open serial port; a zero byte ends the pulse. line: pyserial's port; code: the byte, 1 to 255."""

    def __init__(self, line: Any, code: int) -> None:
        self._line, self._code = line, code

    def raise_level(self) -> None:
        self._send_code(self._code)

    def lower_level(self) -> None:
        self._send_code(0)

    def close(self) -> None:
        self._line.close()

    def _send_code(self, code: int) -> None:
        """Send a byte. Raises OSError."""
        self._line.write(bytes([code]))


class _SerialControlLine:
    """A control line of an open serial port. line: pyserial's port; kind: serial-dtr or serial-rts."""

    def __init__(self, line: Any, kind: str) -> None:
        self._line, self._name = line, kind.removeprefix("serial-")

    def raise_level(self) -> None:
        setattr(self._line, self._name, True)

    def lower_level(self) -> None:
        setattr(self._line, self._name, False)

    def close(self) -> None:
        self._line.close()


class _ParallelPort:
    """The data lines of a parallel port through Linux' driver ppdev. Raises OSError on other systems, and where the
    port cannot be opened or claimed. Tested with a simulated driver only."""

    def __init__(self, settings: PulseSettings) -> None:
        if sys.platform != "linux":
            raise OSError("parallel ports are supported on Linux only")
        self._code = settings.code
        self._file = Path(settings.port).open("r+b", buffering=0)  # noqa: SIM115 - open as long as the line is
        try:
            self._send_ioctl(CLAIM_PORT, None)
        except OSError:
            self._file.close()
            raise

    def raise_level(self) -> None:
        self._send_ioctl(WRITE_DATA, self._code)

    def lower_level(self) -> None:
        self._send_ioctl(WRITE_DATA, 0)

    def close(self) -> None:
        with contextlib.suppress(OSError):
            self._send_ioctl(RELEASE_PORT, None)
        self._file.close()

    def _send_ioctl(self, request: int, value: int | None) -> None:
        """Send an ioctl request with a byte as its argument; value None: without one. Raises OSError."""
        import fcntl

        fcntl.ioctl(self._file, request, 0 if value is None else bytes([value]))
