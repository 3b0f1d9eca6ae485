"""Result of an analysis, with the files it wrote, as a value for screen and command line."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from analysis.psychophysics.thresholds import Threshold


@dataclass(frozen=True, slots=True)
class WrittenAnalysis:
    """Thresholds of an analysis, and the path of the report that was written."""

    thresholds: "tuple[Threshold, ...]"
    table: tuple[str, ...]
    """Group means by frequency, as lines of text."""
    warnings: tuple[str, ...]
    report: Path
