"""Live state of a running session, for viewers in other processes.

It is written to `live.json` beside the session's log (`study.store.sessions.live_file`), where it replaces the previous
state. No result depends on it: the record of a session is its log.
"""

from dataclasses import dataclass
from typing import Literal

Activity = Literal[
    "preparing", "form", "instructions", "demo", "waiting for the handle", "trial", "rest", "pause", "idle",
    "probe", "reference",
]  # fmt: skip
"""Present activity of the session. `idle`: between two actions; `probe`, `reference`: measurements of the device."""


@dataclass(frozen=True, slots=True)
class LiveState:
    """Present state of a session. It contains no direction of a stimulus, because it can be read during a trial."""

    utc: str
    """Time of this state (ISO 8601)."""
    activity: Activity
    since_utc: str
    """Time at which this activity began (ISO 8601)."""
    fault: str
    """Fault of the device in words; empty without a fault."""
    offset_mm: float | None
    """Distance of the handle from the position at which trials start (mm); None where its position is unknown."""
    handle_ready: bool
    """False while a session waits for the handle to be within the radius at which a trial may start."""
    acceleration_mps2: float | None
    """Norm of the last reading of the accelerometer (m/s²); None without a reading."""
    sensor_clipped: bool
    """Whether a channel of the accelerometer is at the limit of its range."""
    missed_ticks: int
    """Number of missed ticks of the control loop in the present stimulus."""
    monotonic_s: float | None = None
    """Reading of the session's monotonic clock at `utc` (s), as in its log; None from older versions."""
    telemetry: str = ""
    """Path of the ring buffer into which the device's control loop writes every tick; empty without one."""
