"""Settings of `hapteq reproduce`, its folders, and its progress."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

Place = tuple[float, float, float]
"""Position of the handle, x, y, z (m)."""

CENTRE: Place = (0.0, 0.0, 0.0)
"""Centre of the workspace."""
EDGE: Place = (0.0, 0.05, 0.0)
"""Near the edge of a workspace whose soft stops begin at 75 mm."""
BETWEEN: tuple[Place, ...] = ((0.0, 0.03, 0.0), (0.0, 0.065, 0.0))
"""Places where models for interpolation are identified beside the centre: never the edge place itself, so that
playback there tests the interpolation."""


@dataclass(frozen=True, slots=True)
class ReproducedProtocols:
    """Names of shipped protocols, or files."""

    study: str = "direction_threshold"
    ellipsoid: str = "ellipsoid"
    sweep: str = "sweep"
    """Sweep over the whole range, for figures 1 and 4."""
    band: str = "sweep_band"
    """Sweep over the equalized band, for figure 5."""
    hand: str = "sweep_hand"
    """The same in a hand, for the table of baselines."""


@dataclass(frozen=True, slots=True)
class ReproductionPlan:
    """Order of a reproduction: output folder, number of participants, seed, and settings of the identified models."""

    out: Path
    subjects: int = 10
    seed: int = 1
    workers: int = 2
    protocols: ReproducedProtocols = ReproducedProtocols()
    order: int = 26
    band_hz: tuple[float, float] = (5.0, 35.0)
    period_s: float = 10.0
    """Period of what is played through the equalizer; its inverse is the line spacing."""

    @property
    def study(self) -> Path:
        """Data folder of the simulated participants."""
        return self.out / "study"

    @property
    def recordings(self) -> Path:
        """Folder of the recordings of the simulated device."""
        return self.out / "recordings"

    @property
    def models(self) -> Path:
        """Folder of the identified models."""
        return self.out / "models"

    @property
    def figures(self) -> Path:
        """Folder of the figures."""
        return self.out / "figures"


class Steps:
    """Combines the progress of steps of different length."""

    def __init__(self, weights: Mapping[str, float], on_progress: Callable[[float], None]) -> None:
        self._weights = weights
        self._on_progress = on_progress
        self._done: dict[str, float] = {}

    def of(self, step: str) -> Callable[[float], None]:
        """Progress callback for one step: takes its own share, 0 to 1."""
        return lambda share: self._report_share(step, share)

    def _report_share(self, step: str, share: float) -> None:
        # Where a piece is played again its progress steps back; the whole does not.
        self._done[step] = max(self._done.get(step, 0.0), min(share, 1.0))
        done = sum(weight * self._done.get(name, 0.0) for name, weight in self._weights.items())
        self._on_progress(done / sum(self._weights.values()))
