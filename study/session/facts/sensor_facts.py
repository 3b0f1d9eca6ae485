"""Counts of the samples received and lost from an accelerometer with its own clock, while a stimulus was played."""

from pydantic.dataclasses import dataclass

from study.session.facts.fact_types import Count, Measured, Seconds
from study.session.facts.sitting_events import FACT


@dataclass(frozen=True, config=FACT)
class SensorFacts:
    """What the log says of the accelerometer for one trial, from the onset until the handle was at rest."""

    packets: Count
    """Whole ones."""
    lost: Count
    """Missing between those, by their numbers: torn and garbled ones are among them."""
    spoiled_bytes: Count
    """That belonged to no whole packet."""
    restarts: Count
    """Number of restarts of the sensor's board."""
    ticks: Count = 0
    """Ticks of the recording; 0 where there is none."""
    unplaced_ticks: Count = 0
    """Those of them at which the acceleration is not known."""
    drift_ppm: Measured | None = None
    """Drift of the sensor's clock against the computer's, > 0: it is slow. Null where it was not fitted."""
    longest_delay_s: Seconds | None = None
    """Longest delay of an arrival, beyond the shortest, in the minutes to which the clock was fitted."""

    @property
    def missing(self) -> float:
        """Share of what should be there: of packets or of ticks, the larger one. 1 where nothing came."""
        packets = self.lost / (self.packets + self.lost) if self.packets else 1.0
        return max(packets, self.unplaced_ticks / max(self.ticks, 1))
