"""Streams of the signals of a running session's device over the lab streaming layer (LSL): force, acceleration, motion
and status of the loop at every tick, in addition to the session's markers.

They are read from the loop's telemetry ring by a separate program, so that streaming never delays the loop.
"""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from equalizer.signals.signal import FloatArray
from study.devices.opening import open_telemetry
from study.errors import StudyError
from study.store.sessions.live_file import read_live
from study.workflows.views.lsl_outlets import SignalOutlet, StreamDescription

if TYPE_CHECKING:
    from study.devices.telemetry import TelemetryReader

LOOK_EVERY = 10
"""Calls of `push` between two checks whether the session uses another ring, as a resumed session does."""


def _three(name: str) -> tuple[str, str, str]:
    """Channel names of the components of a vector."""
    return (f"{name}_x", f"{name}_y", f"{name}_z")


STREAMS = (
    StreamDescription("hapteq force", "Force", (*_three("commanded"), *_three("applied")), ("N",) * 6),
    StreamDescription("hapteq acceleration", "Acceleration", _three("acceleration"), ("m/s^2",) * 3),
    StreamDescription("hapteq motion", "Motion", (*_three("position"), *_three("velocity")), ("m",) * 3 + ("m/s",) * 3),
    StreamDescription("hapteq loop", "Status", ("tick", "phase", "fault", "missed_ticks"), ("",) * 4),
)
"""Name, kind, channels and units of each stream, in the order in which `_push_new_rows` sends the signals."""


class SignalStreams:
    """Sends the telemetry of a session's device to LSL outlets. folder: of the session. open_outlet(stream, rate_hz):
    called for each stream when a ring is found for the first time."""

    def __init__(self, folder: Path, open_outlet: Callable[[StreamDescription, float], SignalOutlet]) -> None:
        self._folder = folder
        self._open_outlet = open_outlet
        self._path, self._calls = "", 0
        self._reader: TelemetryReader | None = None
        self._outlets: tuple[SignalOutlet, ...] = ()
        self.sent = 0
        """Number of ticks sent so far."""

    def push(self, offset_s: float) -> int:
        """Send the ticks since the last call. offset_s: LSL's clock minus the session's, s. Returns the number of ticks
        that were overwritten in the ring before they could be read."""
        lost = self._push_new_rows(offset_s)
        if self._calls % LOOK_EVERY == 0:
            self._switch_ring()
        self._calls += 1
        return lost

    def _switch_ring(self) -> None:
        """Change to the session's present ring, and open the outlets when a ring is found for the first time."""
        live = read_live(self._folder)
        if live is None or live.telemetry == self._path:
            return
        try:
            self._reader = open_telemetry(live.telemetry) if live.telemetry else None
            self._path = live.telemetry
        except StudyError:  # this sitting has ended, or its ring cannot be opened yet: the next check tries again
            self._reader, self._path = None, ""
        if self._reader is not None and not self._outlets:
            self._outlets = tuple(self._open_outlet(stream, self._reader.rate_hz) for stream in STREAMS)

    def _push_new_rows(self, offset_s: float) -> int:
        """Send the rows that the ring has gained; returns the number of rows that were lost."""
        if self._reader is None:
            return 0
        lost_before = self._reader.lost
        read = self._reader.read()
        if len(read):
            status: FloatArray = np.stack([read.tick, read.phase, read.fault, read.missed], axis=1)
            signals = (
                np.hstack([read.commanded_n, read.applied_n]),
                read.acceleration_mps2,
                np.hstack([read.position_m, read.velocity_m_per_s]),
                status,
            )
            for outlet, samples in zip(self._outlets, signals, strict=True):
                outlet.push(samples, read.time_s + offset_s)
            self.sent += len(read)
        return self._reader.lost - lost_before
