"""Result of an analysis and the path of its report.

`analyze_data` returns it to `write_results`, the screens (`engine_commands`) and the command line. A separate module,
so that its import loads no statistics and plots.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from analysis.psychophysics.thresholds import Threshold


@dataclass(frozen=True, slots=True)
class WrittenAnalysis:
    """Thresholds of an analysis, and the path of the report that was written."""

    thresholds: "tuple[Threshold, ...]"
    """Result of each run of the analysed sessions."""
    table: tuple[str, ...]
    """Group means (N) by frequency, as lines of text."""
    warnings: tuple[str, ...]
    """Sentences on excluded sessions, results written now, and warnings of the analysis."""
    report: Path
    """Path of the HTML report."""
