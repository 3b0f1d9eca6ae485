"""Settings of `hapteq reproduce`, the folders of its results, and the progress over its steps."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

Place = tuple[float, float, float]
"""Position of the handle, x, y, z (m)."""

CENTRE: Place = (0.0, 0.0, 0.0)
"""Centre of the workspace."""
EDGE: Place = (0.0, 0.05, 0.0)
"""Near the edge of a workspace whose soft stops begin at 75 mm."""
INTERMEDIATE_PLACES: tuple[Place, ...] = ((0.0, 0.03, 0.0), (0.0, 0.065, 0.0))
"""Places at which further models are identified for interpolation, in addition to the centre. `EDGE` is not among them,
so that playback there tests the interpolation."""


@dataclass(frozen=True, slots=True)
class ReproducedProtocols:
    """Protocols of the reproduction: names of shipped protocols, or paths of files."""

    study: str = "direction_threshold"
    ellipsoid: str = "ellipsoid"
    sweep: str = "sweep"
    """Sweep over the whole range, for figures 1 and 4."""
    band: str = "sweep_band"
    """Sweep over the equalized band, for figure 5."""
    hand: str = "sweep_hand"
    """Sweep over the same band with a hand on the handle, for the table of baselines."""


@dataclass(frozen=True, slots=True)
class ReproductionPlan:
    """Settings of a reproduction: output folder, number of participants, seed, and settings of the identified
    models."""

    out: Path
    subjects: int = 10
    seed: int = 1
    workers: int = 2
    protocols: ReproducedProtocols = ReproducedProtocols()
    order: int = 26
    """Order of the identified models."""
    band_hz: tuple[float, float] = (5.0, 35.0)
    """Equalized band: lowest and highest frequency (Hz)."""
    period_s: float = 10.0
    """Period (s) of the signals played through the equalizer; its inverse is the line spacing (Hz)."""

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
    """Overall progress of steps of different duration: the mean of their progress, weighted by `weights`."""

    def __init__(self, weights: Mapping[str, float], on_progress: Callable[[float], None]) -> None:
        self._weights = weights
        self._on_progress = on_progress
        self._done: dict[str, float] = {}

    def progress_of(self, step: str) -> Callable[[float], None]:
        """Progress callback for one step: takes its own share, 0 to 1."""
        return lambda share: self._report_share(step, share)

    def _report_share(self, step: str, share: float) -> None:
        # A step that is repeated reports a smaller share again; the overall progress must not decrease.
        self._done[step] = max(self._done.get(step, 0.0), min(share, 1.0))
        done = sum(weight * self._done.get(name, 0.0) for name, weight in self._weights.items())
        self._on_progress(done / sum(self._weights.values()))
