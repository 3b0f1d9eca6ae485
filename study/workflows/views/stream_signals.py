"""Stream the signals of a running session's device over the lab streaming layer (LSL): force, acceleration, motion and
status of the control loop at every tick.

`hapteq stream`, a separate program, reads the telemetry ring buffer of the loop, so that streaming never delays it.
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

CALLS_PER_RING_CHECK = 10
"""Number of calls of `push` per check whether the session uses another ring buffer, as after resuming. Chosen."""


def _make_component_names(name: str) -> tuple[str, str, str]:
    """Make the names of the three components of a vector: NAME_x, NAME_y, NAME_z."""
    return (f"{name}_x", f"{name}_y", f"{name}_z")


STREAMS = (
    StreamDescription(
        "hapteq force", "Force", (*_make_component_names("commanded"), *_make_component_names("applied")), ("N",) * 6
    ),
    StreamDescription("hapteq acceleration", "Acceleration", _make_component_names("acceleration"), ("m/s^2",) * 3),
    StreamDescription(
        "hapteq motion",
        "Motion",
        (*_make_component_names("position"), *_make_component_names("velocity")),
        ("m",) * 3 + ("m/s",) * 3,
    ),
    StreamDescription("hapteq loop", "Status", ("tick", "phase", "fault", "missed_ticks"), ("",) * 4),
)
"""Name, content type, channels and units of each stream, in the order in which `_push_new_rows` sends the signals."""


class SignalStreams:
    """Sender of the telemetry of a session's device to LSL outlets."""

    def __init__(self, folder: Path, open_outlet: Callable[[StreamDescription, float], SignalOutlet]) -> None:
        """folder: of the session. open_outlet: makes the outlet of a stream with this sample rate (Hz); called for each
        stream when the first ring buffer is opened."""
        self._folder = folder
        self._open_outlet = open_outlet
        self._ring_path, self._call_count = "", 0
        self._reader: TelemetryReader | None = None
        self._outlets: tuple[SignalOutlet, ...] = ()
        self.sent_ticks = 0
        """Number of ticks sent so far."""

    def push(self, offset_s: float) -> int:
        """Send the ticks since the last call. offset_s: LSL's clock minus the session's monotonic clock (s). Returns
        the number of ticks that were overwritten in the ring buffer before they could be read."""
        lost_ticks = self._push_new_rows(offset_s)
        if self._call_count % CALLS_PER_RING_CHECK == 0:
            self._switch_ring()
        self._call_count += 1
        return lost_ticks

    def _switch_ring(self) -> None:
        """Open the session's present ring buffer if it is another one, and the outlets for the first."""
        live_state = read_live(self._folder)
        if live_state is None or live_state.telemetry == self._ring_path:
            return
        try:
            self._reader = open_telemetry(live_state.telemetry) if live_state.telemetry else None
            self._ring_path = live_state.telemetry
        except StudyError:  # the sitting has ended, or its ring cannot be opened yet: the next check tries again
            self._reader, self._ring_path = None, ""
        if self._reader is not None and not self._outlets:
            self._outlets = tuple(self._open_outlet(stream, self._reader.rate_hz) for stream in STREAMS)

    def _push_new_rows(self, offset_s: float) -> int:
        """Send the rows (ticks) written into the ring buffer since the last call. Returns the number lost since."""
        if self._reader is None:
            return 0
        earlier_lost_count = self._reader.lost
        rows = self._reader.read()
        if len(rows):
            loop_status: FloatArray = np.stack([rows.tick, rows.phase, rows.fault, rows.missed], axis=1)
            signals = (
                np.hstack([rows.commanded_n, rows.applied_n]),
                rows.acceleration_mps2,
                np.hstack([rows.position_m, rows.velocity_m_per_s]),
                loop_status,
            )
            for outlet, samples in zip(self._outlets, signals, strict=True):
                outlet.push(samples, rows.time_s + offset_s)
            self.sent_ticks += len(rows)
        return self._reader.lost - earlier_lost_count
