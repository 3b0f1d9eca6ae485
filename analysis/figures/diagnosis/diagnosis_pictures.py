"""Draw the figures of one diagnosis, in independent units of work, so that one that crashes can be left out (`Guard`).

`draw_diagnosis_pictures` is part of the Python interface (`analysis`).
"""

from collections.abc import Callable, Sequence
from functools import partial

from analysis.diagnosis.result.findings import Findings
from analysis.diagnosis.result.residual_spectrum import compute_held_out_spectra
from analysis.diagnosis.search.guard import Guard, WorkPart
from analysis.figures.diagnosis.held_out import make_held_out_picture
from analysis.figures.diagnosis.mismatch_map import make_mismatch_map_picture, rank_driving_inputs
from analysis.figures.diagnosis.residual_spectra import make_residual_spectra_picture
from analysis.figures.diagnosis.rivals import make_rivals_pictures
from analysis.figures.diagnosis.signature import make_signature_pictures
from analysis.figures.diagnosis.state_maps import make_state_map_pictures
from analysis.figures.picture import Picture, convert_to_sample_units


def draw_diagnosis_pictures(findings: Findings, guard: Guard | None = None) -> tuple[Picture, ...]:
    """Draw the figures for which there are data. guard: records a crash and leaves its figure out; by default, or where
    it is off, exceptions propagate."""
    picture_lists = (guard or Guard()).run_parts(map, list_drawings(findings))
    return tuple(picture for pictures in picture_lists for picture in pictures)


def list_drawings(findings: Findings) -> list[WorkPart]:
    """List the drawings as independent units of work; each returns its pictures, none where there are no data."""
    # Where the measured channels are forces, the motion is imposed, so that levels have no unit of force.
    is_motion_imposed = any(
        channel_unit.startswith("N") for series in findings.time_series for channel_unit in series.units
    )
    level_unit = "" if is_motion_imposed else findings.given.system.force
    held_out_data = findings.time_series, findings.noise_rms, findings.channel_errors

    def draw_map(input_number: int) -> Sequence[Picture]:
        return [make_mismatch_map_picture(findings.maps, input_number, level_unit)]

    drawings: list[tuple[str, Callable[[], Sequence[Picture]]]] = [
        *(
            ("the mismatch map", partial(draw_map, input_number))
            for input_number in range(len(rank_driving_inputs(findings.maps)))
        ),
        ("the map of states", lambda: make_state_map_pictures(findings.state_maps)),
        ("the figure of signatures", lambda: make_signature_pictures(findings.signatures)),
        ("the figure of rivals", lambda: make_rivals_pictures(findings.explanation, findings.axes or ("x", "y", "z"))),
        (
            "the figure of held-out errors",
            lambda: [make_held_out_picture(*held_out_data)] if held_out_data[0] or held_out_data[2] else [],
        ),
        ("the spectrum of the residual", lambda: _make_residual_spectra_pictures(findings)),
    ]
    return [
        WorkPart(name, "its drawing", partial(_draw_with_time_labels, draw, findings.is_timed), ())
        for name, draw in drawings
    ]


def _draw_with_time_labels(draw: Callable[[], Sequence[Picture]], is_timed: bool) -> Sequence[Picture]:
    """Draw the pictures. is_timed: whether the time axis is known; else their labels are in samples instead of s."""
    return draw() if is_timed else [convert_to_sample_units(picture) for picture in draw()]


def _make_residual_spectra_pictures(findings: Findings) -> list[Picture]:
    """Make the picture of the residual spectra; none where no samples were held out."""
    spectra = compute_held_out_spectra(findings.time_series, findings.floor)
    return [make_residual_spectra_picture(spectra)] if spectra else []
