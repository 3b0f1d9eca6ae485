"""Report of a diagnosis: what the model lacks, the evidence for it, and how much better it predicts with it."""

from collections.abc import Mapping, Sequence

from analysis.diagnosis.document import NamedEffect
from analysis.diagnosis.localisation.localisation_words import localisation_sentences
from analysis.diagnosis.result.ceiling_wording import (
    black_box_beats,
    black_box_sentence,
    confirmation_sentence,
    describe_ceiling,
)
from analysis.diagnosis.result.findings import Findings
from analysis.diagnosis.result.plausibility import implausible_sentences
from analysis.diagnosis.result.retuned_parameters import describe_retuning, doubtful_sentences
from analysis.diagnosis.result.wording import (
    answer_of,
    device_of,
    effect_sentence,
    effect_title,
    final_moved_parameters,
    inseparable_sentence,
    next_experiment_sentence,
    remainder_sentence,
    rival_sentences,
    share_sentence,
    signature_texts,
)
from analysis.figures.picture import Picture
from analysis.reports.diagnosis_distortion import distortion_sections
from analysis.reports.diagnosis_method import method_paragraphs
from analysis.reports.diagnosis_tables import (
    candidate_table,
    channel_table,
    error_table,
    mismatch_table,
    parameter_table,
    rival_table,
    tabulate_retuned,
)
from analysis.reports.page import Page, Section, Table, render_page
from analysis.wording import capitalise


def render_diagnosis_report(
    found: Findings, pictures: Sequence[Picture], provenance: Mapping[str, str], generated: str
) -> str:
    """HTML. pictures: of `analysis.figures.diagnosis.diagnosis_pictures`, for the same findings."""
    diagnosis = found.diagnosis
    sections = [
        *_answer_sections(found),
        _localisation_section(found, pictures),
        *distortion_sections(found),
        *(_effect_section(found, number, pictures) for number in range(len(diagnosis.effects))),
        *_candidate_sections(found),
        *_rival_sections(pictures),
        _error_section(found, pictures),
        _remainder_section(found, pictures),
        _parameter_section(found),
        *_black_box_sections(found),
        *_sentence_sections("The next recording", next_experiment_sentence(diagnosis)),
        *_remark_sections(found),
        Section("How this was done", paragraphs=method_paragraphs(found)),
    ]
    return render_page(
        Page(
            title=f"Diagnosis of {found.given.name}",
            summary=answer_of(found),
            banner=_banner(found),
            sections=tuple(sections),
            generated=generated,
            provenance=provenance,
        )
    )


def _banner(found: Findings) -> str:
    """Doubts about the answer."""
    named = bool(found.diagnosis.effects)
    doubts = [confirmation_sentence(found.diagnosis.fit.fit, found.diagnosis.fit.test)] if named else []
    if named and found.black_box is not None and black_box_beats(found.black_box):
        doubts.append(black_box_sentence(found.black_box, named))
    return " ".join(doubt for doubt in doubts if doubt)


def _answer_sections(found: Findings) -> list[Section]:
    """Sections of a diagnosis that names physics: one sentence for each effect, and what they leave open."""
    effects, signatures = found.diagnosis.effects, signature_texts(found)
    if not effects:
        return []
    points = [
        " ".join(filter(None, (_effect_text(found, effect, signatures), inseparable_sentence(effect))))
        for effect in effects
    ]
    after = [remainder_sentence(found.diagnosis, device_of(found)), next_experiment_sentence(found.diagnosis)]
    return [Section("What the model lacks", points=(*points, *filter(None, after)))]


def _candidate_sections(found: Findings) -> list[Section]:
    table = candidate_table(found)
    return [] if table is None else [Section("What else may be missing", tables=(table,))]


def _black_box_sections(found: Findings) -> list[Section]:
    text = black_box_sentence(found.black_box, bool(found.diagnosis.effects))
    paragraphs = tuple(filter(None, (*describe_ceiling(found.reached), text)))
    return [Section("Comparison with a black box", paragraphs=paragraphs)] if paragraphs else []


_NO_MAP = "There is no map: the noise of this recording is not known."


def _localisation_section(found: Findings, pictures: Sequence[Picture]) -> Section:
    sentences = localisation_sentences(found.local) if found.maps else (_NO_MAP,)
    listed = mismatch_table("The places that differ most, as given", found.diagnosis.mismatch, found.is_timed)
    return Section(
        "Where model and device disagree",
        paragraphs=sentences,
        pictures=(*_select_pictures(pictures, "state"), *_select_pictures(pictures, "mismatch-map")),
        tables=(listed,),
    )


def _effect_section(found: Findings, number: int, pictures: Sequence[Picture]) -> Section:
    effect = found.diagnosis.effects[number]
    placed = next((each.effect for each in found.named if each.effect.name == effect.effect), None)
    paragraphs = [share_sentence(effect)]
    if placed is not None:
        paragraphs += [f"Equation: {placed.equation}.", f"Source: {placed.source}."]
    rivals = rival_sentences(effect)
    if not rivals and not inseparable_sentence(effect):
        paragraphs.append("No rival fits nearly as well.")
    return Section(
        capitalise(effect_title(effect, _has_single_input(found))),
        paragraphs=tuple(paragraphs),
        pictures=_signature_pictures(found, effect, pictures),
        tables=(parameter_table(effect), *((rival_table(effect),) if effect.rivals else ())),
    )


def _signature_pictures(found: Findings, effect: NamedEffect, pictures: Sequence[Picture]) -> tuple[Picture, ...]:
    """Signatures of the effect: only those at its own axis where it has one there."""
    of_effect = [
        number for number, signature in enumerate(found.signatures, start=1) if signature.effect == effect.effect
    ]
    there = [number for number in of_effect if found.signatures[number - 1].axis == effect.axis]
    names = {f"signature-{number}" for number in (there or of_effect)}
    return tuple(picture for picture in pictures if picture.name in names)


def _rival_sections(pictures: Sequence[Picture]) -> list[Section]:
    shown = _select_pictures(pictures, "rivals")
    return [Section("What else was tried", pictures=shown)] if shown else []


def _error_section(found: Findings, pictures: Sequence[Picture]) -> Section:
    tables: list[Table] = [error_table(found)]
    tables += [table for part in ("test", "fit") if (table := channel_table(found, part)) is not None]
    return Section("How well it predicts", pictures=_select_pictures(pictures, "held-out"), tables=tuple(tables))


def _remainder_section(found: Findings, pictures: Sequence[Picture]) -> Section:
    left = found.diagnosis.remainder
    tables = (mismatch_table("Remaining mismatch", left, found.is_timed),) if left else ()
    return Section(
        "What is still unexplained",
        paragraphs=(remainder_sentence(found.diagnosis, device_of(found)),),
        pictures=_select_pictures(pictures, "remainder"),
        tables=tables,
    )


_UNMOVED = {
    False: "No parameter changed by more than the standard deviation of its calibration.",
    True: "No parameter changed by more than the tolerance of the first fit.",
}
"""Key: whether the model was fitted to the recordings first."""


def _parameter_section(found: Findings) -> Section:
    moved = final_moved_parameters(found)
    text = describe_retuning(moved, found.fitted) or _UNMOVED[found.fitted]
    table = tabulate_retuned(found)
    return Section(
        "The model's own parameters",
        paragraphs=(text,),
        points=doubtful_sentences(moved, found.fitted),
        tables=(table,) if table is not None else (),
    )


def _remark_sections(found: Findings) -> list[Section]:
    points = (*implausible_sentences(found), *found.remarks)
    return [Section("Remarks", points=points)] if points else []


def _sentence_sections(heading: str, sentence: str) -> list[Section]:
    return [Section(heading, paragraphs=(sentence,))] if sentence else []


def _effect_text(found: Findings, effect: NamedEffect, signatures: Mapping[str, str]) -> str:
    return effect_sentence(effect, signatures.get(effect.effect, ""), _has_single_input(found))


def _has_single_input(found: Findings) -> bool:
    return found.given.inputs == 1


def _select_pictures(pictures: Sequence[Picture], kind: str) -> tuple[Picture, ...]:
    return tuple(picture for picture in pictures if picture.name == kind or picture.name.startswith(f"{kind}-"))
