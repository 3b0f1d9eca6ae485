"""A diagnosis in words and tables, from its document. Reads only."""

from pathlib import Path

from analysis.diagnosis.document import Diagnosis, Errors, Estimate, Mismatch, NamedEffect, Rival, Verdict
from analysis.wording import NONE, listed
from study.session.archive_views import DiagnosisView
from study.session.printable import printable
from study.store.diagnosis_file import read_diagnosis

VERDICTS: dict[Verdict, str] = {
    "no_mismatch": "Model and device agree: what is left is no larger than repeats allow.",
    "parameters": "The model's own parameters explain the mismatch: re-tuned within their tolerances, it fits.",
    "explained": "The mismatch is explained by physics that the model lacks, named below.",
    "partly_explained": "The mismatch is explained in part: physics that the model lacks is named, and more remains.",
    "unexplained": "There is a mismatch, and nothing in the catalogue of effects earns its place.",
}
MISMATCH_HEADER = ("output", "input", "band", "amplitude", "where", "share", "p")
FIT_HEADER = ("record", "given model", "re-tuned", "with effects", "repeats allow")


def diagnosis_view(path: Path) -> DiagnosisView:
    """Raises CannotReadError, UnusableFileError."""
    diagnosis = read_diagnosis(path)
    report = path.parent / "report.html"
    view = DiagnosisView(
        path=str(path),
        verdict=VERDICTS[diagnosis.verdict],
        sentences=tuple(_effect(effect) for effect in diagnosis.effects),
        rivals=tuple(_rival(effect, rival) for effect in diagnosis.effects for rival in effect.rivals),
        mismatch=_mismatches(diagnosis.mismatch),
        fit=(FIT_HEADER, _errors("fit", diagnosis.fit.fit), _errors("test", diagnosis.fit.test)),
        remainder=_mismatches(diagnosis.remainder),
        next_experiment=_next(diagnosis),
        report=str(report) if report.is_file() else "",
        notes=_notes(diagnosis),
    )
    return printable(view)


def _effect(effect: NamedEffect) -> str:
    parameters = listed([_estimate(name, estimate) for name, estimate in effect.parameters.items()])
    return (
        f"{_plain(effect.effect)[:1].upper()}{_plain(effect.effect)[1:]} in the {effect.place}"
        f"{f', axis {effect.axis}' if effect.axis else ''}: {parameters}. It explains {_percent(effect.share)} of the "
        f"mismatch left after re-tuning (probability {_probability(effect.probability)})."
    )


def _estimate(name: str, estimate: Estimate) -> str:
    unit = "" if estimate.unit == "1" else f" {estimate.unit}"
    interval = f" (95 %: {estimate.ci95[0]:.3g} to {estimate.ci95[1]:.3g})" if estimate.ci95 else " (no interval)"
    return f"{_plain(name)} {estimate.value:.3g}{unit}{interval}"


def _rival(effect: NamedEffect, rival: Rival) -> str:
    tie = f" These data cannot tell it from {_plain(effect.effect)}." if rival.inseparable else ""
    why = rival.why_not.strip()
    return f"{_plain(rival.effect)} (probability {_probability(rival.probability)}): {why or 'no reason is given'}{tie}"


def _mismatches(mismatches: tuple[Mismatch, ...]) -> tuple[tuple[str, ...], ...]:
    return (MISMATCH_HEADER, *map(_mismatch, mismatches)) if mismatches else ()


def _mismatch(mismatch: Mismatch) -> tuple[str, ...]:
    return (
        mismatch.output,
        mismatch.input,
        f"{mismatch.band_hz[0]:g} to {mismatch.band_hz[1]:g} Hz",
        "all" if mismatch.amplitude is None else f"{mismatch.amplitude:g}",
        mismatch.state or "",
        _percent(mismatch.share),
        f"{mismatch.p_value:.1e}" if 0 < mismatch.p_value < 1e-3 else f"{mismatch.p_value:.3f}",
    )


def _errors(record: str, errors: Errors) -> tuple[str, ...]:
    values = (errors.before, errors.retuned, errors.after, errors.noise)
    return (record, *(NONE if value is None else f"{value:.4f}" for value in values))


def _next(diagnosis: Diagnosis) -> str:
    following = diagnosis.next_experiment
    if following is None:
        return ""
    splits = f" It tells {listed([_plain(name) for name in following.splits])} apart." if following.splits else ""
    return f"{following.command}\n{following.why}{splits}"


def _notes(diagnosis: Diagnosis) -> tuple[str, ...]:
    measured = f"Errors are normalised root-mean-square over the channels, measured by {diagnosis.error}."
    if not diagnosis.retuned:
        return (measured,)
    return (measured, f"Re-tuned: {listed(list(diagnosis.retuned))}.")


def _plain(name: str) -> str:
    return name.replace("_", " ")


def _percent(share: float) -> str:
    return f"{100 * share:.0f} %"


def _probability(probability: float) -> str:
    return "> 0.99" if probability > 0.99 else f"{probability:.2f}"
