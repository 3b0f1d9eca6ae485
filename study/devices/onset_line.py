"""Electrical pulse at the onset of each trial's force, for an external recorder (EEG, EMG, a camera).

A byte or a control line of a serial port, or the data lines of a parallel one, behind one small port. A line that hangs
or is gone costs no trial: the pulse is told as lost, and the next one tries to open the line anew.
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

PATIENCE_S = 0.05
"""Timeout for a pulse; a healthy line takes well below a millisecond."""

CLAIM, WRITE_DATA, RELEASE = 0x708B, 0x40017086, 0x708C
"""Requests of Linux' parallel port driver (ppdev)."""


class Line(Protocol):
    """An open line. Where it is gone, any call raises OSError, as pyserial does."""

    def raise_level(self) -> None:
        """Set the line or the data lines, or send the byte."""
        ...

    def lower_level(self) -> None:
        """Set the line or the data lines back, or send a zero byte."""
        ...

    def close(self) -> None:
        """Close the port."""
        ...


@dataclass(frozen=True, slots=True)
class Pulse:
    """Result of a request for a trigger pulse."""

    line: str
    """Which line, in words."""
    at_s: float | None
    """Monotonic clock of this program as the line had taken it; None: it is not known to have gone out."""
    trouble: str = ""
    """Why not; empty where it did."""


@checked_dataclass(frozen=True, config=STRICT)
class PulseSettings:
    """`[pulse]` of the lab's file."""

    kind: Literal["serial-byte", "serial-dtr", "serial-rts", "parallel"]
    port: str
    """/dev/ttyUSB0, COM3; of a parallel port /dev/parport0."""
    code: Annotated[int, Field(ge=1, le=255)] = 1
    """The byte that is sent, or what the data lines of a parallel port show. The control lines have no code."""
    width_s: Annotated[float, Field(gt=0, le=0.1)] = 0.005
    """After it, the byte 0 is sent, or the line is lowered."""
    baud: Annotated[int, Field(gt=0)] = 115_200

    @property
    def words(self) -> str:
        """Which line, in words, for the log."""
        how = {"serial-byte": f"byte {self.code}", "serial-dtr": "DTR", "serial-rts": "RTS"}
        return f"{how.get(self.kind, f'data lines {self.code}')} of {self.port}"


class OnsetLine:
    """`pulse` gives a pulse and never raises; a thread of its own talks to the line.

    open_line raises OSError. line: one that is open already, else the first pulse opens it."""

    def __init__(
        self, settings: PulseSettings, open_line: Callable[[PulseSettings], Line], line: Line | None = None
    ) -> None:
        self._settings = settings
        self._open_line = open_line
        self._line = line
        self._asked: SimpleQueue[SimpleQueue[Pulse] | None] = SimpleQueue()
        self._busy = threading.Lock()
        self._thread = threading.Thread(target=self._run_thread, name="onset line", daemon=True)
        self._thread.start()

    def pulse(self) -> Pulse:
        """Waits until it has gone out, at most `PATIENCE_S`."""
        if self._busy.locked():
            return self._lost_pulse("the pulse before it still hangs")
        answer: SimpleQueue[Pulse] = SimpleQueue()
        self._asked.put(answer)
        try:
            return answer.get(timeout=PATIENCE_S)
        except Empty:
            return self._lost_pulse(f"the line took none within {1000 * PATIENCE_S:g} ms")

    def close(self) -> None:
        """Lowers the line. Never raises."""
        self._asked.put(None)
        self._thread.join(1.0)

    def _run_thread(self) -> None:
        while (answer := self._asked.get()) is not None:
            with self._busy:
                self._hand_over(answer)
        self._hang_up()

    def _hand_over(self, answer: SimpleQueue[Pulse]) -> None:
        try:
            self._line = self._line or self._open_line(self._settings)
            self._line.raise_level()
        except Exception as problem:  # noqa: BLE001 - a trial goes on without its pulse for any error of a driver
            answer.put(self._lost_pulse(str(problem) or type(problem).__name__))
            self._hang_up()
            return
        answer.put(Pulse(self._settings.words, time.monotonic()))
        time.sleep(self._settings.width_s)
        with contextlib.suppress(Exception):  # the next pulse finds out
            self._line.lower_level()

    def _hang_up(self) -> None:
        line, self._line = self._line, None
        if line is not None:
            for last in (line.lower_level, line.close):
                with contextlib.suppress(Exception):
                    last()

    def _lost_pulse(self, trouble: str) -> Pulse:
        return Pulse(self._settings.words, None, trouble)


def open_onset_line(settings: PulseSettings) -> OnsetLine:
    """Opened once, before a session: opening it resets some boards, which then take no byte for a second or two.
    Raises `DeviceError` for a line that cannot be opened."""
    try:
        line = open_port(settings)
    except (OSError, ValueError) as problem:
        raise DeviceError(
            "The line for onset pulses cannot be opened",
            f"{settings.words}: {problem}.",
            "Plug it in, or take [pulse] out of the device's file (docs/hardware.md).",
        ) from problem
    return OnsetLine(settings, open_port, line)


def open_port(settings: PulseSettings) -> Line:
    """Open a serial line for onset pulses. Raises OSError, ValueError, and `DeviceError` where pyserial is missing."""
    if settings.kind == "parallel":
        return _Parallel(settings)
    try:
        import serial
    except ImportError as error:
        raise DeviceError(
            "The line for onset pulses cannot be opened",
            "The package pyserial is not installed.",
            "Install hapteq with its hardware extra: pip install '.[hardware]'.",
        ) from error
    line = serial.Serial(baudrate=settings.baud, write_timeout=PATIENCE_S, exclusive=True)
    if settings.kind != "serial-byte":
        line.dtr = line.rts = False  # else opening it would be a pulse
    line.port = settings.port
    line.open()
    return _SerialByte(line, settings.code) if settings.kind == "serial-byte" else _SerialControl(line, settings.kind)


class _SerialByte:
    def __init__(self, line: Any, code: int) -> None:
        self._line, self._code = line, code

    def raise_level(self) -> None:
        self._send_code(self._code)

    def lower_level(self) -> None:
        self._send_code(0)

    def close(self) -> None:
        self._line.close()

    def _send_code(self, code: int) -> None:
        self._line.write(bytes([code]))


class _SerialControl:
    """kind: serial-dtr or serial-rts."""

    def __init__(self, line: Any, kind: str) -> None:
        self._line, self._name = line, kind.removeprefix("serial-")

    def raise_level(self) -> None:
        setattr(self._line, self._name, True)

    def lower_level(self) -> None:
        setattr(self._line, self._name, False)

    def close(self) -> None:
        self._line.close()


class _Parallel:
    """The data lines of a parallel port by Linux' ppdev. Tested against a scripted driver only."""

    def __init__(self, settings: PulseSettings) -> None:
        if sys.platform != "linux":
            raise OSError("parallel ports are supported on Linux only")
        self._code = settings.code
        self._file = Path(settings.port).open("r+b", buffering=0)  # noqa: SIM115 - open as long as the line is
        try:
            self._control(CLAIM, None)
        except OSError:
            self._file.close()
            raise

    def raise_level(self) -> None:
        self._control(WRITE_DATA, self._code)

    def lower_level(self) -> None:
        self._control(WRITE_DATA, 0)

    def close(self) -> None:
        with contextlib.suppress(OSError):
            self._control(RELEASE, None)
        self._file.close()

    def _control(self, request: int, value: int | None) -> None:
        import fcntl

        fcntl.ioctl(self._file, request, 0 if value is None else bytes([value]))
