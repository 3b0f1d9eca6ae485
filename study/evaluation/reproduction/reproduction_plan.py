"""Settings of `hapteq reproduce`, the folders of its results, and its overall progress."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

Place = tuple[float, float, float]
"""Position of the handle, x, y, z (m)."""

CENTRE: Place = (0.0, 0.0, 0.0)
"""Centre of the workspace."""
EDGE: Place = (0.0, 0.05, 0.0)
"""Position near the edge of the workspace, whose soft stops begin 75 mm from the centre. Chosen."""
INTERMEDIATE_PLACES: tuple[Place, ...] = ((0.0, 0.03, 0.0), (0.0, 0.065, 0.0))
"""Positions at which further models are identified for interpolation, in addition to the centre. `EDGE` is not among
them, so that playback there tests the interpolation. Chosen."""


@dataclass(frozen=True, slots=True)
class ReproducedProtocols:
    """Protocols of the reproduction: names of shipped protocols, or paths of files."""

    study: str = "direction_threshold"
    """Threshold study of the simulated participants, for figure 2."""
    ellipsoid: str = "ellipsoid"
    """Recording along many directions, for figure 3 (acceleration ellipsoids)."""
    sweep: str = "sweep"
    """Sweep over the whole frequency range, for figures 1 and 4."""
    band: str = "sweep_band"
    """Sweep over the equalized band, for figure 5."""
    hand: str = "sweep_hand"
    """Sweep over the same band with a hand on the handle, for the table of baselines."""


@dataclass(frozen=True, slots=True)
class ReproductionPlan:
    """Settings of a reproduction of the paper's figures, and the folders of its results."""

    output_folder: Path
    """Folder of all results."""
    subjects: int = 10
    """Number of simulated participants."""
    seed: int = 1
    """Seed of participants and devices."""
    workers: int = 2
    """Number of worker processes."""
    protocols: ReproducedProtocols = ReproducedProtocols()
    """Protocols of study and recordings."""
    order: int = 26
    """Order (number of states) of the identified models."""
    band_hz: tuple[float, float] = (5.0, 35.0)
    """Equalized band: lowest and highest frequency (Hz)."""
    period_s: float = 10.0
    """Period (s) of the signals played through the equalizer; its inverse is the line spacing (Hz)."""

    @property
    def study(self) -> Path:
        """Data folder of the simulated participants."""
        return self.output_folder / "study"

    @property
    def recordings(self) -> Path:
        """Folder of the recordings of the simulated device."""
        return self.output_folder / "recordings"

    @property
    def models(self) -> Path:
        """Folder of the identified models."""
        return self.output_folder / "models"

    @property
    def figures(self) -> Path:
        """Folder of the figures."""
        return self.output_folder / "figures"


class StepProgress:
    """Overall progress of several steps: the mean of their completed fractions, weighted by their expected durations.

    weights: by name of the step; on_progress: called with the overall progress, 0 to 1.
    """

    def __init__(self, weights: Mapping[str, float], on_progress: Callable[[float], None]) -> None:
        self._weights = weights
        self._on_progress = on_progress
        self._completed_shares: dict[str, float] = {}

    def make_callback(self, step: str) -> Callable[[float], None]:
        """Make the callback by which a step reports its completed fraction, 0 to 1. A step without a weight does not
        count."""
        return lambda share: self._report_share(step, share)

    def _report_share(self, step: str, share: float) -> None:
        """Store the completed fraction of a step and report the overall progress."""
        # A step that is repeated reports a smaller share again; the overall progress must not decrease.
        self._completed_shares[step] = max(self._completed_shares.get(step, 0.0), min(share, 1.0))
        weighted_sum = sum(weight * self._completed_shares.get(name, 0.0) for name, weight in self._weights.items())
        self._on_progress(weighted_sum / sum(self._weights.values()))
