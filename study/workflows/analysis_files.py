"""What an analysis leaves in a folder. Apart from the analysis itself, which loads statistics and plots."""

from pathlib import Path

from study.store.real_folder import is_real_folder
from study.store.thresholds_file import DETECTION_NAME, THRESHOLDS_NAME

ANALYSIS_NAME = "analysis"
"""Where an analysis goes, in the folder that was analysed, if nobody says otherwise."""

OURS = ("thresholds", "delivered", "ellipsoids", "staircases-*")
"""Names of figures, so that those of an earlier analysis (of a participant who withdrew since) do not stay."""

OUR_FILES = (THRESHOLDS_NAME, DETECTION_NAME, "anova.json", "report.html")


def written_by_analysis(out: Path) -> tuple[Path, ...]:
    """The files in `out` that an analysis writes, as far as they are there. None behind a link to another folder."""
    figures = out / "figures"
    drawn = [path for name in OURS for kind in ("svg", "png") for path in figures.glob(f"{name}.{kind}")]
    tables = [out / name for name in OUR_FILES if (out / name).is_file()]
    return (*tables, *(drawn if is_real_folder(figures) else ()))
