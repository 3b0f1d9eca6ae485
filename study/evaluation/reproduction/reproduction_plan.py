"""What `hapteq reproduce` is asked for, where it keeps what is done, and how far it is."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

Place = tuple[float, float, float]

CENTRE: Place = (0.0, 0.0, 0.0)
EDGE: Place = (0.0, 0.05, 0.0)
"""Towards the edge of a workspace whose soft stops begin at 75 mm."""
BETWEEN: tuple[Place, ...] = ((0.0, 0.03, 0.0), (0.0, 0.065, 0.0))
"""Where models for interpolation are identified beside the centre's: never at the edge place itself, so that what is
played there is a test of the interpolation."""


@dataclass(frozen=True, slots=True)
class ReproducedProtocols:
    """Names of shipped protocols, or files."""

    study: str = "direction_threshold"
    ellipsoid: str = "ellipsoid"
    sweep: str = "sweep"
    """Over the whole range, for figures 1 and 4."""
    band: str = "sweep_band"
    """Of the band that is equalized, for figure 5."""
    hand: str = "sweep_hand"
    """The same in a hand, for the table of other ways."""


@dataclass(frozen=True, slots=True)
class ReproductionPlan:
    out: Path
    subjects: int = 10
    seed: int = 1
    workers: int = 2
    protocols: ReproducedProtocols = ReproducedProtocols()
    order: int = 26
    band_hz: tuple[float, float] = (5.0, 35.0)
    period_s: float = 10.0
    """Of what is played through the equalizer: lines are its inverse apart."""

    @property
    def study(self) -> Path:
        return self.out / "study"

    @property
    def recordings(self) -> Path:
        return self.out / "recordings"

    @property
    def models(self) -> Path:
        return self.out / "models"

    @property
    def figures(self) -> Path:
        return self.out / "figures"


class Steps:
    """Turns the shares of steps of different length into one."""

    def __init__(self, weights: Mapping[str, float], on_progress: Callable[[float], None]) -> None:
        self._weights = weights
        self._on_progress = on_progress
        self._done: dict[str, float] = {}

    def of(self, step: str) -> Callable[[float], None]:
        """For the step: takes its own share, 0 to 1."""
        return lambda share: self._tell(step, share)

    def _tell(self, step: str, share: float) -> None:
        # Where a piece is played again its progress steps back; the whole does not.
        self._done[step] = max(self._done.get(step, 0.0), min(share, 1.0))
        done = sum(weight * self._done.get(name, 0.0) for name, weight in self._weights.items())
        self._on_progress(done / sum(self._weights.values()))
