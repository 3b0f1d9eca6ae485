"""Names of the files that an analysis writes, and a search for those that exist in a folder.

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

FIGURE_NAME_PATTERNS = (
    "thresholds",
    "medians",
    "units",
    "psychometric",
    "psychometric-*",
    "delivered",
    "ellipsoids",
    "staircases-*",
)
"""Name patterns of the figures of an analysis."""

STATISTICS_FORMAT, STATISTICS_VERSION = "hapteq-anova", 1
"""Name and version of the format of the statistics, of `study_analysis.make_anova_document`."""
STATISTICS_NAME, PAGE_NAME = "anova.json", "report.html"
"""Names of the document with the statistics and of the HTML report."""
ANALYSIS_FILE_NAMES = (THRESHOLDS_NAME, DETECTION_NAME, STATISTICS_NAME, PAGE_NAME)
"""Files of an analysis other than its figures; the report, `PAGE_NAME`, is written last."""


def is_analysis_of(folder: Path, log: Path) -> bool:
    """Whether the analysis in `folder` is complete (its report is written last) and was made from the present content
    of `log`, by the SHA-256 in its provenance; False for damaged files."""
    if not (folder / PAGE_NAME).is_file():
        return False
    try:
        provenance = read_json(folder / STATISTICS_NAME, STATISTICS_FORMAT, STATISTICS_VERSION).get("provenance")
        parents = provenance.get("parents") if isinstance(provenance, dict) else None
        return isinstance(parents, list) and {"file": log.name, "sha256": compute_sha256(log)} in parents
    except StudyError:
        return False


def list_analysis_outputs(folder: Path) -> tuple[Path, ...]:
    """List the existing files in `folder` that an analysis writes; no figures where `figures` is a link."""
    figure_folder = folder / "figures"
    figure_files = [
        path
        for file_name in FIGURE_NAME_PATTERNS
        for extension in ("svg", "png")
        for path in figure_folder.glob(f"{file_name}.{extension}")
    ]
    data_files = [folder / file_name for file_name in ANALYSIS_FILE_NAMES if (folder / file_name).is_file()]
    return (*data_files, *(figure_files if is_real_folder(figure_folder) else ()))
