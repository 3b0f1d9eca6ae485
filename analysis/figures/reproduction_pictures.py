"""The five figures of the reproduction report, by the number of the published figure that each reproduces.

1: frequency bands and onset of coupling. 2: direction thresholds by frequency. 3: acceleration ellipses. 4: transfer
functions. 5: response from wanted to delivered acceleration, with a second picture for the effect of friction.
"""

from collections.abc import Mapping, Sequence

from analysis.evaluation.reproduction.equalized_findings import EqualizedRows
from analysis.evaluation.reproduction.measured_device import MeasuredDevice
from analysis.figures.frequency_bands import frequency_bands_picture
from analysis.figures.picture import Picture
from analysis.figures.played_responses import make_friction_picture, make_played_responses_picture
from analysis.figures.study_pictures import make_ellipsoid_picture, study_pictures
from analysis.figures.transfer_functions import make_transfer_functions_picture
from analysis.psychophysics.ellipsoid import EllipsoidResult
from analysis.psychophysics.study_analysis import StudyAnalysis
from equalizer.identification.frequency_response.frequency_bands import FrequencyBand


def reproduction_pictures(
    study: StudyAnalysis,
    shapes: Sequence[EllipsoidResult],
    device: MeasuredDevice,
    bands: Sequence[FrequencyBand],
    direction_limit_hz: float,
    rows: EqualizedRows,
) -> Mapping[int, tuple[Picture, ...]]:
    """Pictures by number of the published figure; figure 2 has none where no run has a threshold. direction_limit_hz:
    frequency from which directions are no longer perceived, drawn in figure 1."""
    return {
        1: (frequency_bands_picture(device.response, device.onset, bands, direction_limit_hz),),
        2: tuple(picture for picture in study_pictures(study) if picture.name == "thresholds"),
        3: (make_ellipsoid_picture(shapes),),
        4: (make_transfer_functions_picture(device.response),),
        5: (make_played_responses_picture(rows.figure_rows), make_friction_picture(rows.friction_rows)),
    }
