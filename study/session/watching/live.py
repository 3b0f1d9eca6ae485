"""Live state of a running session, written beside its log for a viewer. Values only, replaced often."""

from dataclasses import dataclass
from typing import Literal

Activity = Literal[
    "preparing", "form", "instructions", "demo", "waiting for the handle", "trial", "rest", "pause", "idle",
    "probe", "reference",
]  # fmt: skip
"""What the session does now. `idle`: between two trials; `probe`, `reference`: measurements between trials."""


@dataclass(frozen=True, slots=True)
class Live:
    """Current state. Never contains a direction: it is readable while a trial runs."""

    utc: str
    activity: Activity
    since_utc: str
    """When this activity began."""
    fault: str
    """The device's fault in words; empty where there is none."""
    offset_mm: float | None
    """Present distance of the handle from its place."""
    handle_ready: bool
    """Within the gate's radius; true where there is no gate."""
    acceleration_mps2: float | None
    """What the accelerometer reads now, norm; None without a reading."""
    sensor_clipped: bool
    missed_ticks: int
    """In the present stimulus."""
    monotonic_s: float | None = None
    """Reading of the session's monotonic clock at `utc`, as in its log; None from older versions."""
    telemetry: str = ""
    """Path of the ring into which the device's loop writes every tick; empty if there is none."""
