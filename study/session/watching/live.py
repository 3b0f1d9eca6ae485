"""Live state of a running session, which a viewer in another terminal reads.

The session writes it to `live.json` beside its log, several times a second; the file is replaced each time. The log
alone is the record of the session.
"""

from dataclasses import dataclass
from typing import Literal

Activity = Literal[
    "preparing", "form", "instructions", "demo", "waiting for the handle", "trial", "rest", "pause", "idle",
    "probe", "reference",
]  # fmt: skip
"""Present activity of the session. `idle`: between two trials; `probe`, `reference`: measurements between trials."""


@dataclass(frozen=True, slots=True)
class Live:
    """Present state of the session. It contains no direction, because it can be read while a trial runs."""

    utc: str
    """Time at which this state was written."""
    activity: Activity
    since_utc: str
    """Time at which this activity began."""
    fault: str
    """Fault of the device in words; empty without a fault."""
    offset_mm: float | None
    """Present distance of the handle from the place at which trials start; None where the position is unknown."""
    handle_ready: bool
    """Whether the handle is within the gate (the radius within which a trial may start); true without a gate."""
    acceleration_mps2: float | None
    """Present reading of the accelerometer, norm of the three axes; None without a reading."""
    sensor_clipped: bool
    """Whether the accelerometer is at the limit of its range."""
    missed_ticks: int
    """Number of missed ticks of the control loop in the present stimulus."""
    monotonic_s: float | None = None
    """Reading of the session's monotonic clock at `utc`, as in its log; None from older versions."""
    telemetry: str = ""
    """Path of the ring buffer into which the device's control loop writes every tick; empty if there is none."""
