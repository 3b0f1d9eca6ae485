"""All figures of one diagnosis, in the order of the report."""

from analysis.diagnosis.result.findings import Findings
from analysis.diagnosis.result.remainder_spectrum import remainder_spectra
from analysis.figures.diagnosis_held_out import held_out_picture
from analysis.figures.diagnosis_mismatch_map import mismatch_map_pictures
from analysis.figures.diagnosis_remainder import remainder_picture
from analysis.figures.diagnosis_rivals import rivals_pictures
from analysis.figures.diagnosis_signature import signature_pictures
from analysis.figures.diagnosis_state_maps import state_map_pictures
from analysis.figures.picture import Picture


def diagnosis_pictures(found: Findings) -> tuple[Picture, ...]:
    """Only what there is data for."""
    # Where a motion is imposed and the force measured, levels are the motion's, in a unit of their own.
    imposed = any(unit.startswith("N") for course in found.courses for unit in course.units)
    unit = "" if imposed else found.given.system.force
    pictures = [*mismatch_map_pictures(found.maps, unit), *state_map_pictures(found.state_maps)]
    pictures += [*signature_pictures(found.signatures)]
    pictures += rivals_pictures(found.explanation, found.axes or ("x", "y", "z"))
    if found.channel_errors or found.courses:
        pictures.append(held_out_picture(found.courses, found.noise_rms, found.channel_errors))
    spectra = remainder_spectra(found.courses, found.floor)
    return (*pictures, remainder_picture(spectra)) if spectra else tuple(pictures)
