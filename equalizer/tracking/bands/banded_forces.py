"""Result of the banded equalizer: forces, the accelerations they are predicted to give, and their cost."""

from dataclasses import dataclass

from equalizer.signals.signal import FloatArray
from equalizer.tracking.bands.high_band import HighBandForces
from equalizer.tracking.bands.low_band import SlowMotion
from equalizer.tracking.bands.stylus import StylusShare
from equalizer.tracking.feedforward.band_split import Bands
from equalizer.tracking.lqr.constrained import TrackingLoss
from equalizer.tracking.lqr.limits import Peaks


@dataclass(frozen=True, slots=True, eq=False)
class BandedForces:
    """Forces per row: the rows of the wanted acceleration, and the run-in and run-out around them; see
    `rows_of_wanted`."""

    commands: FloatArray
    """(N, m), N: commands, to which the rendered spring adds its force."""
    entering: FloatArray
    """(N, m), N: force that enters the device, the spring's included."""
    by_band: tuple[FloatArray, FloatArray, FloatArray]
    """(N, m) each: low, middle, high part of `entering`"""
    predicted: tuple[FloatArray, FloatArray, FloatArray]
    """m/s², predicted acceleration of each band, (N, p): by the high band's response where there is one, which also
    covers what the low and middle forces do outside their bands; else by each band's own model."""
    bands: Bands
    """The wanted acceleration of each band."""
    latency_samples: int
    """Samples by which `commands` lags the wanted rows when these arrive one by one."""
    peaks: Peaks | None
    """Force peaks of `entering`; None without a cap."""
    loss: TrackingLoss | None
    """Loss of tracking in the middle band due to the cap; None where the cap did not act."""
    motion: SlowMotion | None
    high: HighBandForces | None
    stylus: StylusShare | None

    @property
    def predicted_total(self) -> FloatArray:
        """(N, p), m/s²"""
        return self.predicted[0] + self.predicted[1] + self.predicted[2]

    def rows_of_wanted(self, samples: int) -> slice:
        """Slice of the rows that correspond to the wanted rows, where all are known beforehand."""
        return slice(self.latency_samples, self.latency_samples + samples)
