"""All results from which the five figures are made."""

from dataclasses import dataclass
from pathlib import Path

from analysis.evaluation.reproduction.document import UsedModel
from analysis.evaluation.reproduction.measured_device import MeasuredDevice
from analysis.evaluation.reproduction.played_response import PlayedResponse
from analysis.psychophysics.ellipsoid import EllipsoidResult
from analysis.psychophysics.study_analysis import StudyAnalysis
from equalizer.identification.state_space.held_out import HeldOut
from study.evaluation.reproduction.reproduce_equalized import EqualizedPlayback


@dataclass(frozen=True, slots=True, eq=False)
class Results:
    """Results of all steps of a reproduction, from which document, figures and page are made."""

    study: StudyAnalysis
    ellipsoids: tuple[EllipsoidResult, ...]
    device: MeasuredDevice
    device_name: str
    played: EqualizedPlayback
    baselines: tuple[PlayedResponse, ...]
    models: tuple[UsedModel, ...]
    tested: HeldOut | None
    """Held-out test of the centre's model."""
    tested_frictionless: HeldOut | None
    remarks: tuple[str, ...]
    """Remarks on recordings and models, as sentences."""
    sources: tuple[Path, ...]
    """Input files."""
    protocol_hash: str
    """Hash of the study protocol."""
