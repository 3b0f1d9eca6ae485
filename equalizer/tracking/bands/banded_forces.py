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
    """Rows: the wanted ones, and the run-in and run-out around them; see `rows_of_wanted`."""

    commands: FloatArray
    """(N, m), N: what is sent, beside the rendered spring"""
    entering: FloatArray
    """(N, m), N: what enters the device, with the spring's force"""
    by_band: tuple[FloatArray, FloatArray, FloatArray]
    """(N, m) each: low, middle, high part of `entering`"""
    predicted: tuple[FloatArray, FloatArray, FloatArray]
    """m/s², what each of them delivers: (N, p), by the high band's response where there is one, which also knows of
    what the low and middle forces do outside their bands; else by its own model."""
    bands: Bands
    """What was wanted of each"""
    latency_samples: int
    """By how much a row of `commands` is behind the wanted row it plays, when wanted rows come in one by one"""
    peaks: Peaks | None
    """Of `entering`; None without a cap"""
    loss: TrackingLoss | None
    """What the cap cost in the middle band; None where nothing was constrained"""
    motion: SlowMotion | None
    high: HighBandForces | None
    stylus: StylusShare | None

    @property
    def predicted_total(self) -> FloatArray:
        """(N, p), m/s²"""
        return self.predicted[0] + self.predicted[1] + self.predicted[2]

    def rows_of_wanted(self, samples: int) -> slice:
        """The rows that go with the wanted ones, one to one, where all is known beforehand."""
        return slice(self.latency_samples, self.latency_samples + samples)
