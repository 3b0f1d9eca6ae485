"""All figures of one diagnosis, in the order of the report.

Each figure is an independent piece of work, so that a figure whose drawing crashes can be left out (`Guard`).
"""

from collections.abc import Callable, Sequence
from functools import partial

from analysis.diagnosis.result.findings import Findings
from analysis.diagnosis.result.residual_spectrum import remainder_spectra
from analysis.diagnosis.search.guard import Guard, Part
from analysis.figures.diagnosis.held_out import held_out_picture
from analysis.figures.diagnosis.mismatch_map import mismatch_map_picture, rank_driving_inputs
from analysis.figures.diagnosis.remainder import remainder_picture
from analysis.figures.diagnosis.rivals import rivals_pictures
from analysis.figures.diagnosis.signature import signature_pictures
from analysis.figures.diagnosis.state_maps import state_map_pictures
from analysis.figures.picture import Picture, count_in_samples


def diagnosis_pictures(found: Findings, guard: Guard | None = None) -> tuple[Picture, ...]:
    """Draw the figures for which there are data. guard: notes crashes and leaves the figure out; without it, or while
    it is off, exceptions propagate."""
    drawn = (guard or Guard()).parts(map, diagnosis_drawings(found))
    return tuple(picture for several in drawn for picture in several)


def diagnosis_drawings(found: Findings) -> list[Part]:
    """The drawings as independent pieces of work; each returns its pictures, none where there are no data."""
    # Where a motion is imposed and the force is measured, levels are those of the motion, and have no force unit.
    imposed = any(unit.startswith("N") for series in found.time_series for unit in series.units)
    unit = "" if imposed else found.given.system.force
    held = found.time_series, found.noise_rms, found.channel_errors

    def mapped(number: int) -> Sequence[Picture]:
        return [mismatch_map_picture(found.maps, number, unit)]

    drawn: list[tuple[str, Callable[[], Sequence[Picture]]]] = [
        *(("the mismatch map", partial(mapped, number)) for number in range(len(rank_driving_inputs(found.maps)))),
        ("the map of states", lambda: state_map_pictures(found.state_maps)),
        ("the figure of signatures", lambda: signature_pictures(found.signatures)),
        ("the figure of rivals", lambda: rivals_pictures(found.explanation, found.axes or ("x", "y", "z"))),
        ("the figure of held-out errors", lambda: [held_out_picture(*held)] if held[0] or held[2] else []),
        ("the spectrum of the residual", lambda: _remainder(found)),
    ]
    return [Part(name, "its drawing", partial(_with_time_labels, draw, found.is_timed), ()) for name, draw in drawn]


def _with_time_labels(draw: Callable[[], Sequence[Picture]], timed: bool) -> Sequence[Picture]:
    """The pictures; with labels in samples instead of seconds where the time axis is unknown."""
    return draw() if timed else [count_in_samples(picture) for picture in draw()]


def _remainder(found: Findings) -> list[Picture]:
    """The picture of the residual spectra; none where no samples were held out."""
    spectra = remainder_spectra(found.time_series, found.floor)
    return [remainder_picture(spectra)] if spectra else []
