"""Result of the banded equalizer: forces, predicted accelerations, and loss of tracking due to the force cap.

N: rows, m: axes of force, p: axes of acceleration. Forces in N, accelerations in m/s², one row per sample.
"""

from dataclasses import dataclass

from equalizer.signals.signal import FloatArray
from equalizer.tracking.bands.high_band import HighBandForces
from equalizer.tracking.bands.low_band import SlowMotion
from equalizer.tracking.bands.stylus import StylusShare
from equalizer.tracking.feedforward.band_split import Bands
from equalizer.tracking.lqr.constrained import TrackingLoss
from equalizer.tracking.lqr.limits import ForcePeaks


@dataclass(frozen=True, slots=True, eq=False)
class BandedForces:
    """Forces and predicted accelerations. Row `latency_samples` is the first row of the reference acceleration; the
    rows before and after it are the run-in and the run-out, see `find_reference_rows`."""

    commands: FloatArray
    """(N, m), N: forces to command. The rendered spring of the device's control loop adds its own force to them."""
    total_forces: FloatArray
    """(N, m), N: total force on the device, commands and spring together."""
    by_band: tuple[FloatArray, FloatArray, FloatArray]
    """(N, m), N: the parts of `total_forces` of the low, middle and high band."""
    predicted: tuple[FloatArray, FloatArray, FloatArray]
    """(N, p), m/s²: predicted acceleration due to the forces of each band. Where there is a high band, its response is
    used for all three, because it covers the effect of a band's forces outside that band; else each band's model."""
    bands: Bands
    """The reference acceleration, split into bands."""
    latency_samples: int
    """Number of rows before the first of the reference: delay of the band split and, unless it is causal, the
    run-in."""
    peaks: ForcePeaks | None
    """Largest norms of `total_forces`, against the cap; None without a cap."""
    loss: TrackingLoss | None
    """Loss of tracking in the middle band due to the force cap; None where no cap constrained it."""
    motion: SlowMotion | None
    """Planned motion of the low band; None without a low band."""
    high: HighBandForces | None
    """Forces of the high band and their direction; None without a high band."""
    stylus: StylusShare | None
    """Share of a stylus actuator; None without one."""

    @property
    def predicted_total(self) -> FloatArray:
        """(N, p), m/s²: predicted acceleration due to all forces."""
        return self.predicted[0] + self.predicted[1] + self.predicted[2]

    def find_reference_rows(self, row_count: int) -> slice:
        """Find the rows that correspond to the reference acceleration, as a slice. row_count: number of its rows."""
        return slice(self.latency_samples, self.latency_samples + row_count)
