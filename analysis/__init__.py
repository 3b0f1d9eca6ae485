"""Data analysis. Pure functions: trials and recordings in, results, figures and pages out; no files, no screens.

Folders: `psychophysics` (trials -> thresholds and statistics), `look` (checks of recordings before any model),
`device_change` (changes of a device between recordings), `diagnosis` (recordings and a model -> the physics that the
model lacks), `evaluation` (scores of blind tests, comparison with published figures); `figures` and `reports` present
the results. `wording` formats numbers and sentences, `threshold_words` the kinds of thresholds. Begin at
`psychophysics/study_analysis.py` or `diagnosis/diagnose.py`.

Decisions:

2026-11-21. The published one-way analysis of variance is computed as published; the analysis within participants
(repeated measures) is reported in addition, with the difference in words: readers need the first for comparison with
the paper, the second for inference.
2026-11-22. A threshold of a staircase with a peak at the force cap is reported as censored, not as a lower bound: in
some runs it lies above the true threshold. The mark is set by peaks at the cap, because comparing the mean with the cap
would miss every participant who guesses (their staircases end near 2.7 N of 3 N). The measured operating
characteristics are in `psychophysics.thresholds.is_censored`.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from analysis.diagnosis.diagnose_values import diagnose_values as diagnose
    from analysis.diagnosis.diagnosis_settings import DiagnosisSettings as DiagnosisSettings
    from analysis.diagnosis.first_model.choose_structure import choose_structure as first_structure
    from analysis.diagnosis.result.findings import Findings as Findings
    from analysis.figures.diagnosis.diagnosis_pictures import draw_diagnosis_pictures as diagnosis_pictures
    from analysis.figures.study_pictures import draw_study_pictures as study_pictures
    from analysis.look.overview import make_overview as overview
    from analysis.psychophysics.study_analysis import StudyAnalysis as StudyAnalysis
    from analysis.psychophysics.study_analysis import analyse_study as analyse_study

_HOME = {
    "DiagnosisSettings": "analysis.diagnosis.diagnosis_settings:DiagnosisSettings",
    "Findings": "analysis.diagnosis.result.findings:Findings",
    "StudyAnalysis": "analysis.psychophysics.study_analysis:StudyAnalysis",
    "analyse_study": "analysis.psychophysics.study_analysis:analyse_study",
    "diagnose": "analysis.diagnosis.diagnose_values:diagnose_values",
    "diagnosis_pictures": "analysis.figures.diagnosis.diagnosis_pictures:draw_diagnosis_pictures",
    "first_structure": "analysis.diagnosis.first_model.choose_structure:choose_structure",
    "overview": "analysis.look.overview:make_overview",
    "study_pictures": "analysis.figures.study_pictures:draw_study_pictures",
}
"""Exported name -> "module:name". Imported at first access, because importing a module may take seconds."""

__all__ = [
    "DiagnosisSettings",
    "Findings",
    "StudyAnalysis",
    "analyse_study",
    "diagnose",
    "diagnosis_pictures",
    "first_structure",
    "overview",
    "study_pictures",
]


def __getattr__(name: str) -> Any:
    """The exported object of this name, imported at first access (PEP 562). Raises AttributeError for other names."""
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    module, _, attribute = _HOME[name].partition(":")
    return getattr(import_module(module), attribute)


def __dir__() -> list[str]:
    return sorted(__all__)
