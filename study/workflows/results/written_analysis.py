"""Result of an analysis and the path of its report.

A separate module, so that its import loads no statistics and plots.
"""

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from analysis.psychophysics.thresholds import Threshold


@dataclass(frozen=True, slots=True)
class WrittenAnalysis:
    """Result of `analyze_data`."""

    thresholds: "tuple[Threshold, ...]"
    """Threshold of each test run of the analysed sessions, incomplete runs included."""
    table: tuple[str, ...]
    """Lines of text for the terminal, by `analyze_data.format_threshold_lines`."""
    warnings: tuple[str, ...]
    """Sentences on excluded sessions, results written now, and warnings of the analysis."""
    report: Path
    """Path of the HTML report."""

    def as_document(self) -> dict[str, Any]:
        """Convert thresholds, warnings and path of the report to JSON values."""
        thresholds = [asdict(threshold) for threshold in self.thresholds]
        return {"thresholds": thresholds, "warnings": list(self.warnings), "report": str(self.report)}
