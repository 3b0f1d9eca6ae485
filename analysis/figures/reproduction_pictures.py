"""Make the five figures of the reproduction report, by the number of the published figure that each reproduces.

1: frequency bands and onset of coupling. 2: direction thresholds by frequency. 3: acceleration ellipses. 4: transfer
functions. 5: response from target to delivered acceleration, with a second picture for the effect of friction.
"""

from collections.abc import Mapping, Sequence

from analysis.evaluation.reproduction.equalized_findings import EqualizedRows
from analysis.evaluation.reproduction.measured_device import MeasuredDevice
from analysis.figures.frequency_bands import make_frequency_bands_picture
from analysis.figures.picture import Picture
from analysis.figures.played_responses import make_friction_picture, make_played_responses_picture
from analysis.figures.study_pictures import draw_study_pictures, make_ellipsoid_picture
from analysis.figures.transfer_functions import make_transfer_functions_picture
from analysis.psychophysics.ellipsoid import EllipsoidResult
from analysis.psychophysics.study_analysis import StudyAnalysis
from equalizer.identification.frequency_response.frequency_bands import FrequencyBand


def make_reproduction_pictures(
    study: StudyAnalysis,
    ellipses: Sequence[EllipsoidResult],
    device: MeasuredDevice,
    bands: Sequence[FrequencyBand],
    direction_limit_hz: float,
    equalized_rows: EqualizedRows,
) -> Mapping[int, tuple[Picture, ...]]:
    """Make the pictures, by number of the published figure; figure 2 has none where no run has a threshold.
    direction_limit_hz: frequency from which directions are no longer perceived, drawn in figure 1."""
    return {
        1: (make_frequency_bands_picture(device.response, device.onset, bands, direction_limit_hz),),
        2: tuple(picture for picture in draw_study_pictures(study) if picture.name == "thresholds"),
        3: (make_ellipsoid_picture(ellipses),),
        4: (make_transfer_functions_picture(device.response),),
        5: (
            make_played_responses_picture(equalized_rows.figure_rows),
            make_friction_picture(equalized_rows.friction_rows),
        ),
    }
