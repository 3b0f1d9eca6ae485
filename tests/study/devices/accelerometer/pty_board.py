"""A board at the other end of a pseudo-terminal: sends packets by a clock of its own as long as it is on."""

import contextlib
import os
import threading
import time
import tty
from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from study.devices.accelerometer.calibration import Calibration
from study.devices.accelerometer.parser import CRC_BYTES, PACKET_DTYPE, PACKET_SIZE, SYNC, compute_crc

SCALE = 600.0
IDEAL = Calibration(np.full(3, 32_768.0), SCALE * np.eye(3), np.zeros(3), 0.0)
RAW_RANGE = (10, 65_525)
AT_REST = np.array([0.0, 0.0, 9.81])


def encode_packets(sequence: npt.ArrayLike, time_us: npt.ArrayLike, raw: npt.ArrayLike) -> bytes:
    """Packets as the firmware sends them; sequence (n,), time_us (n,) and raw (n, 3), taken modulo their range."""
    numbers = np.atleast_1d(np.asarray(sequence, dtype=np.int64))
    packets = np.zeros(len(numbers), dtype=PACKET_DTYPE)
    packets["sync"] = int.from_bytes(SYNC, "little")
    packets["sequence"] = numbers & 0xFFFF
    packets["time_us"] = np.asarray(time_us, dtype=np.int64) & 0xFFFFFFFF
    packets["raw"] = raw
    packets["crc"] = compute_crc(packets.view(np.uint8).reshape(-1, PACKET_SIZE)[:, CRC_BYTES])
    return packets.tobytes()


class Board:
    """`spoil` changes the bytes of a block before they go. drift_ppm > 0: its clock is slow. first_us: what its clock
    shows at the beginning."""

    def __init__(self, rate_hz: float, drift_ppm: float = 0.0, first_us: int = 0) -> None:
        self.master, self.slave = os.openpty()
        tty.setraw(self.slave)
        self.path = os.ttyname(self.slave)
        self.acceleration = AT_REST
        self.signal: Callable[[np.ndarray], np.ndarray] | None = None
        """signal(host_s), (n, 3): instead of `acceleration`."""
        self.rate_hz, self.period_s, self.first_us = rate_hz, (1 + 1e-6 * drift_ppm) / rate_hz, first_us
        self.sent, self.on = 0, True
        self.spoil: Callable[[bytes], bytes] = lambda block: block
        self._reset, self._started_s = 0.0, time.monotonic()
        self._thread = threading.Thread(target=self._send, daemon=True)
        self._thread.start()

    def reset(self, silent_s: float) -> None:
        """As if its button were pressed: number and time begin anew after a silence."""
        self._reset = silent_s

    def taken_s(self, device_s: np.ndarray) -> np.ndarray:
        """Host times (s) of samples by their times of this board's clock (s), as long as it was not reset."""
        return self._started_s + (device_s - 1e-6 * self.first_us) * self.rate_hz * self.period_s

    def _send(self) -> None:
        while self.on:
            if self._reset:
                time.sleep(self._reset)
                self._reset, self.sent, self.first_us = 0.0, 0, 0
                self._started_s = time.monotonic()
            due = 1 + int((time.monotonic() - self._started_s) / self.period_s)
            if due > self.sent:
                numbers = np.arange(self.sent, due)
                taken_s = self._started_s + self.period_s * numbers
                wanted = np.tile(self.acceleration, (len(numbers), 1)) if self.signal is None else self.signal(taken_s)
                raw = np.clip(32_768 + SCALE * wanted, 0, 65_535)
                packets = encode_packets(numbers, self.first_us + 1e6 * numbers / self.rate_hz, raw)
                with contextlib.suppress(OSError):
                    os.write(self.master, self.spoil(packets))
                self.sent = due
            time.sleep(0.002)

    def close(self) -> None:
        self.on = False
        self._thread.join(5.0)
        for end in (self.master, self.slave):
            with contextlib.suppress(OSError):
                os.close(end)


def table_of(board: Board) -> str:
    """Of the lab's file, as the calibration prints it."""
    rows = ", ".join(f"[{', '.join(str(SCALE * (row == column)) for column in range(3))}]" for row in range(3))
    return (
        f'[accelerometer]\nport = "{board.path}"\nbaud = 115200\nbias = [32768.0, 32768.0, 32768.0]\n'
        f"sensitivity = [{rows}]\nraw_range = {list(RAW_RANGE)}\n"
    )


def within(seconds: float, condition: Callable[[], bool]) -> bool:
    until_s = time.monotonic() + seconds
    while not condition() and time.monotonic() < until_s:
        time.sleep(0.005)
    return condition()
