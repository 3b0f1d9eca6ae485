"""Names of the files that an analysis writes, and which of them exist in a folder.

Separate from `analyze_data`, which is slow to import because of its statistics and plots.
"""

from pathlib import Path

from study.errors import StudyError
from study.store.disk.json_document import read_json
from study.store.disk.provenance import compute_sha256
from study.store.disk.real_folder import is_real_folder
from study.store.formats.thresholds_file import DETECTION_NAME, THRESHOLDS_NAME

ANALYSIS_NAME = "analysis"
"""Name of the default output folder, inside the analysed folder."""

OURS = ("thresholds", "medians", "units", "psychometric", "psychometric-*", "delivered", "ellipsoids", "staircases-*")
"""Name patterns of the figures of an analysis. Existing figures are removed before new ones are written, since they may
show a participant who has withdrawn."""

STATISTICS_NAME, PAGE_NAME = "anova.json", "report.html"
"""Names of the document with the statistics and of the report."""
OUR_FILES = (THRESHOLDS_NAME, DETECTION_NAME, STATISTICS_NAME, PAGE_NAME)
"""Files of an analysis other than its figures; the report, `PAGE_NAME`, is written last."""


def is_analysis_of(folder: Path, log: Path) -> bool:
    """Whether the analysis in `folder` is complete (its report is written last) and was made from the present content
    of `log`, by the SHA-256 in its provenance. Never raises for damaged files."""
    if not (folder / PAGE_NAME).is_file():
        return False
    try:
        origin = read_json(folder / STATISTICS_NAME, "hapteq-anova", 1).get("provenance")
        parents = origin.get("parents") if isinstance(origin, dict) else None
        return isinstance(parents, list) and {"file": log.name, "sha256": compute_sha256(log)} in parents
    except StudyError:
        return False


def analysis_outputs(folder: Path) -> tuple[Path, ...]:
    """Existing files in `folder` that an analysis writes; none behind a link to another folder."""
    figures = folder / "figures"
    figure_files = [path for name in OURS for kind in ("svg", "png") for path in figures.glob(f"{name}.{kind}")]
    tables = [folder / name for name in OUR_FILES if (folder / name).is_file()]
    return (*tables, *(figure_files if is_real_folder(figures) else ()))
