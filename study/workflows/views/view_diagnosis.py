"""View of a diagnosis as sentences and tables, from its document `diagnosis.json`. Only reads files."""

from pathlib import Path

from analysis.diagnosis.document import Diagnosis, Errors, Mismatch, NamedEffect
from analysis.diagnosis.effect_words import get_noun
from analysis.diagnosis.result.candidate_wording import DeviceWording, describe_candidates
from analysis.diagnosis.result.wording import (
    describe_effect,
    describe_equivalents,
    describe_remainder,
    describe_rivals,
    describe_verdict,
)
from analysis.diagnosis.unit_wording import format_probability
from analysis.wording import MISSING, conjoin, format_p
from study.errors import StudyError
from study.session.views.archive_views import DiagnosisView
from study.session.views.printable import make_printable
from study.store.formats.diagnosis_file import MODEL_NAME, PAGE_NAME, read_diagnosis
from study.store.formats.mechanical_model_file import read_mechanical_model

MISMATCH_HEADER = ("output", "input", "band", "amplitude", "where", "share", "p")
"""Columns of the table of mismatches: response, command, frequency band, amplitude of the command, state of the device,
share of the mismatch, p-value."""
ERROR_HEADER = ("record", "given model", "re-tuned", "with effects", "repeats allow")
"""Columns of the table of errors on fit and test samples: of the given model, the re-tuned model, the model with the
named effects, and the noise between repeats."""


def make_diagnosis_view(path: Path) -> DiagnosisView:
    """Make the view of a diagnosis. path: its document; the improved model and the HTML report are searched for in the
    same folder. Raises CannotReadError or UnusableFileError where the document cannot be used."""
    diagnosis, device_wording = read_diagnosis(path), _read_device(path.parent / MODEL_NAME)
    report_path = path.parent / PAGE_NAME
    view = DiagnosisView(
        path=str(path),
        verdict=describe_verdict(diagnosis, device=device_wording),
        sentences=tuple(
            sentence for effect in diagnosis.effects for sentence in _describe_named_effect(effect, device_wording)
        ),
        rivals=tuple(sentence for effect in diagnosis.effects for sentence in describe_rivals(effect)),
        mismatch=_tabulate_mismatches(diagnosis.mismatch),
        fit=(ERROR_HEADER, _format_error_row("fit", diagnosis.fit.fit), _format_error_row("test", diagnosis.fit.test)),
        remainder=_tabulate_mismatches(diagnosis.remainder),
        next_experiment=_describe_next_experiment(diagnosis),
        report=str(report_path) if report_path.is_file() else "",
        notes=_list_notes(diagnosis),
        candidates=describe_candidates(diagnosis, device_wording),
    )
    return make_printable(view)


def _read_device(path: Path) -> DeviceWording | None:
    """Read number of axes and units of the improved model in this file, for the wording of parameters; None if it
    cannot be read."""
    try:
        model = read_mechanical_model(path)
    except StudyError:
        return None
    return DeviceWording(model.inputs == 1, model.system)


def _describe_named_effect(effect: NamedEffect, device: DeviceWording | None) -> tuple[str, ...]:
    """Describe in sentences a named effect, and the effects that the recording cannot distinguish from it."""
    effect_text = (
        f"{describe_effect(effect, device=device)} It explains {_format_percent(effect.share)} of the mismatch that "
        f"remains after re-tuning (probability {format_probability(effect.probability)})."
    )
    return tuple(filter(None, (effect_text, describe_equivalents(effect))))


def _tabulate_mismatches(mismatches: tuple[Mismatch, ...]) -> tuple[tuple[str, ...], ...]:
    """Tabulate mismatches below their header; empty without any."""
    return (MISMATCH_HEADER, *map(_format_mismatch_row, mismatches)) if mismatches else ()


def _format_mismatch_row(mismatch: Mismatch) -> tuple[str, ...]:
    """Format a row of the table of mismatches, under `MISMATCH_HEADER`."""
    return (
        mismatch.output,
        mismatch.input,
        f"{mismatch.band_hz[0]:g} to {mismatch.band_hz[1]:g} Hz",
        "all" if mismatch.amplitude is None else f"{mismatch.amplitude:g}",
        mismatch.state or "",
        _format_percent(mismatch.share),
        format_p(mismatch.p_value),
    )


def _format_error_row(sample_set: str, errors: Errors) -> tuple[str, ...]:
    """Format a row of the table of errors (1 = 100 %) under `ERROR_HEADER`; a dash for an error that is not known.
    sample_set: name of the set of samples."""
    values = (errors.before, errors.retuned, errors.after, errors.noise)
    return (sample_set, *(MISSING if value is None else f"{value:.4f}" for value in values))


def _describe_next_experiment(diagnosis: Diagnosis) -> str:
    """Describe command, reason and discriminated effects of the proposed next experiment; empty without a proposal."""
    experiment = diagnosis.next_experiment
    if experiment is None:
        return ""
    proposed_effect, *rivals = (get_noun(name) for name in experiment.splits) if experiment.splits else ("",)
    discrimination_text = f" This distinguishes {proposed_effect} from {conjoin(rivals)}." if rivals else ""
    return f"{experiment.command}\n{experiment.why}{discrimination_text}"


def _list_notes(diagnosis: Diagnosis) -> tuple[str, ...]:
    """List sentences on the error measure, the re-tuned parameters, and the remaining mismatch."""
    retuned_note = (f"Re-tuned: {conjoin(list(diagnosis.retuned))}.",) if diagnosis.retuned else ()
    remainder_note = (describe_remainder(diagnosis),) if diagnosis.verdict in ("explained", "partly_explained") else ()
    measure_note = f"Errors are normalised root-mean-square over the channels, measured by {diagnosis.error}."
    return (measure_note, *retuned_note, *remainder_note)


def _format_percent(share: float) -> str:
    """Format a share (1 = 100 %) in whole percent."""
    return f"{100 * share:.0f} %"
