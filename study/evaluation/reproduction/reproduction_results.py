"""Results of a reproduction of the paper's five figures: filled by `reproduce_paper`, and written by
`write_reproduction` to document, figures and page."""

from dataclasses import dataclass
from pathlib import Path

from analysis.evaluation.reproduction.document import UsedModel
from analysis.evaluation.reproduction.measured_device import MeasuredDevice
from analysis.evaluation.reproduction.played_response import PlayedResponse
from analysis.psychophysics.ellipsoid import EllipsoidResult
from analysis.psychophysics.study_analysis import StudyAnalysis
from equalizer.identification.state_space.held_out_validation import HeldOutValidation
from study.evaluation.reproduction.reproduce_equalized import EqualizedPlayback


@dataclass(frozen=True, slots=True, eq=False)
class ReproductionResults:
    """Results of all steps of a reproduction."""

    study: StudyAnalysis
    """Thresholds of simulated participants (figure 2)."""
    ellipsoids: tuple[EllipsoidResult, ...]
    """Acceleration ellipsoids (figure 3)."""
    device: MeasuredDevice
    """Measured frequency responses of the simulated device (figures 1 and 4)."""
    device_name: str
    """Name of the device in its recordings."""
    equalized_playback: EqualizedPlayback
    """Playback with the equalizer (figure 5)."""
    baselines: tuple[PlayedResponse, ...]
    """Playback by the baseline methods, and by the equalizers designed for the edge and the hand."""
    models: tuple[UsedModel, ...]
    """Models that the equalizer used."""
    held_out_test: HeldOutValidation | None
    """Held-out test of the model identified at the centre of the workspace; None where it was not tested."""
    frictionless_test: HeldOutValidation | None
    """The same for the device without friction."""
    remarks: tuple[str, ...]
    """Remarks on recordings and models, as sentences."""
    sources: tuple[Path, ...]
    """Input files."""
    protocol_hash: str
    """Hash of the study protocol."""
