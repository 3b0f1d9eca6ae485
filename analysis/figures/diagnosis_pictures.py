"""All figures of one diagnosis, in the order of the report."""

from collections.abc import Callable, Sequence

from analysis.diagnosis.result.findings import Findings
from analysis.diagnosis.result.remainder_spectrum import remainder_spectra
from analysis.diagnosis.search.guard import Guard
from analysis.figures.diagnosis_held_out import held_out_picture
from analysis.figures.diagnosis_mismatch_map import mismatch_map_pictures
from analysis.figures.diagnosis_remainder import remainder_picture
from analysis.figures.diagnosis_rivals import rivals_pictures
from analysis.figures.diagnosis_signature import signature_pictures
from analysis.figures.diagnosis_state_maps import state_map_pictures
from analysis.figures.picture import Picture
from analysis.figures.untimed import in_samples


def diagnosis_pictures(found: Findings, guard: Guard | None = None) -> tuple[Picture, ...]:
    """Only what there is data for. guard: of figures whose drawing crashes, which are left out."""
    # Where a motion is imposed and the force measured, levels are the motion's, in a unit of their own.
    imposed = any(unit.startswith("N") for course in found.courses for unit in course.units)
    unit = "" if imposed else found.given.system.force
    held = found.courses, found.noise_rms, found.channel_errors
    drawn: dict[str, Callable[[], Sequence[Picture]]] = {
        "the mismatch map": lambda: mismatch_map_pictures(found.maps, unit),
        "the map of states": lambda: state_map_pictures(found.state_maps),
        "the figure of signatures": lambda: signature_pictures(found.signatures),
        "the figure of rivals": lambda: rivals_pictures(found.explanation, found.axes or ("x", "y", "z")),
        "the figure of held-out errors": lambda: [held_out_picture(*held)] if held[0] or held[2] else [],
        "the spectrum of what is left": lambda: _remainder(found),
    }
    known = guard or Guard()
    none: Sequence[Picture] = ()
    pictures = [picture for name, draw in drawn.items() for picture in known.part(name, "its drawing", draw, none)]
    return tuple(pictures if found.is_timed else map(in_samples, pictures))


def _remainder(found: Findings) -> list[Picture]:
    spectra = remainder_spectra(found.courses, found.floor)
    return [remainder_picture(spectra)] if spectra else []
