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
    """Threshold of each test run of the analysed sessions, incomplete runs included."""
    table: tuple[str, ...]
    """Lines of text for the terminal: mean thresholds (N) by frequency, medians and the declared contrast, as
    `analyze_data.format_threshold_lines` states them."""
    warnings: tuple[str, ...]
    """Sentences on excluded sessions, results written now, and warnings of the analysis."""
    report: Path
    """Path of the HTML report."""
