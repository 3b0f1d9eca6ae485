"""Counts of received and lost samples of an accelerometer that has its own clock, logged for each trial.

Where the missing fraction (`missing`) exceeds the limit of the protocol, `study.workflows.trial.judge_trial` makes the
trial void if the protocol requires the accelerometer, and adds a remark otherwise.
"""

from pydantic.dataclasses import dataclass

from study.session.facts.fact_types import Count, Measured, Seconds
from study.session.facts.sitting_events import FACT_CONFIG


@dataclass(frozen=True, config=FACT_CONFIG)
class SensorFacts:
    """Counts and clock of the accelerometer over an interval: of a trial, from the onset of the stimulus until the
    handle was at rest; also of a device check, and of a recording."""

    packets: Count
    """Number of complete packets received."""
    lost: Count
    """Number of packets missing between the received ones, by their sequence numbers, including incomplete and garbled
    packets."""
    spoiled_bytes: Count
    """Number of received bytes that belong to no complete packet."""
    restarts: Count
    """Number of restarts of the sensor's board."""
    ticks: Count = 0
    """Number of ticks of the control loop in the recording; 0 without a recording."""
    unplaced_ticks: Count = 0
    """Number of ticks of the recording at which the acceleration is unknown."""
    drift_ppm: Measured | None = None
    """Relative drift (ppm) of the sensor's clock against the computer's; positive: the sensor's clock is slow. None
    where the clock could not be fitted."""
    longest_delay_s: Seconds | None = None
    """Largest delay of an arrival minus the smallest (s), over the interval to which the clock was fitted; None where
    it could not be fitted."""

    @property
    def missing(self) -> float:
        """Missing fraction, 0 to 1: of packets or of ticks, whichever is larger; 1 where no packet arrived."""
        lost_fraction = self.lost / (self.packets + self.lost) if self.packets else 1.0
        return max(lost_fraction, self.unplaced_ticks / max(self.ticks, 1))
