"""HTML report of a diagnosis: named effects, the evidence for each, and the prediction errors with and without them.

This module decides the sections and their order; most sentences come from `analysis.diagnosis`, tables from
`diagnosis_tables`, the section on distortion from `diagnosis_distortion`, that on the method from `diagnosis_method`.
"""

from collections.abc import Mapping, Sequence

from analysis.diagnosis.document import NamedEffect, format_law
from analysis.diagnosis.localisation.localisation_words import write_localisation_sentences
from analysis.diagnosis.result.error_wording import (
    describe_balance_errors,
    describe_black_box,
    describe_confirmation,
    is_black_box_better,
)
from analysis.diagnosis.result.findings import Findings
from analysis.diagnosis.result.plausibility import describe_doubts
from analysis.diagnosis.result.retuned_parameters import describe_doubtful_parameters, describe_retuning
from analysis.diagnosis.result.wording import (
    describe_effect,
    describe_equivalents,
    describe_next_experiment,
    describe_remainder,
    describe_rivals,
    describe_share,
    extract_device,
    find_final_moves,
    find_fitted_effect,
    format_effect_title,
    get_signature_text,
    write_answer,
)
from analysis.diagnosis.unit_wording import typeset_unit
from analysis.figures.picture import Picture
from analysis.reports.diagnosis_distortion import make_distortion_sections
from analysis.reports.diagnosis_method import write_method_paragraphs
from analysis.reports.diagnosis_tables import (
    tabulate_candidates,
    tabulate_channel_errors,
    tabulate_errors,
    tabulate_mismatches,
    tabulate_parameters,
    tabulate_retuned,
    tabulate_rivals,
)
from analysis.reports.page import Page, Section, Table, drop_empty, render_page
from analysis.wording import capitalise


def render_diagnosis_report(
    findings: Findings, pictures: Sequence[Picture], provenance: Mapping[str, str], generated: str
) -> str:
    """Render the report as an HTML page. pictures: of `analysis.figures.diagnosis.diagnosis_pictures`, for the same
    findings, recognised by name. provenance: texts by name. generated: local time of the report, as text."""
    diagnosis = findings.diagnosis
    sections = [
        *_make_answer_sections(findings),
        _make_localisation_section(findings, pictures),
        *make_distortion_sections(findings),
        *(_make_effect_section(findings, effect_index, pictures) for effect_index in range(len(diagnosis.effects))),
        *drop_empty(
            Section("What else may be missing", tables=tuple(filter(None, [tabulate_candidates(findings)]))),
            Section("What else was tried", pictures=_select_pictures(pictures, "rivals")),
        ),
        _make_error_section(findings, pictures),
        _make_remainder_section(findings, pictures),
        _make_parameter_section(findings),
        *drop_empty(
            Section("Comparison with a black box", paragraphs=_compare_with_black_box(findings)),
            Section("The next recording", paragraphs=tuple(filter(None, [describe_next_experiment(diagnosis)]))),
            Section("Remarks", points=(*describe_doubts(findings), *findings.remarks)),
        ),
        Section("How this was done", paragraphs=write_method_paragraphs(findings)),
    ]
    return render_page(
        Page(
            title=f"Diagnosis of {findings.given.name}",
            summary=write_answer(findings),
            banner=_join_doubts(findings),
            sections=tuple(sections),
            generated=generated,
            provenance=provenance,
        )
    )


def _join_doubts(findings: Findings) -> str:
    """Join the doubts about the named effects to one text; empty without doubts or without effects."""
    has_effects = bool(findings.diagnosis.effects)
    doubts = [describe_confirmation(findings.diagnosis.fit.fit, findings.diagnosis.fit.test)] if has_effects else []
    if has_effects and findings.black_box is not None and is_black_box_better(findings.black_box):
        doubts.append(describe_black_box(findings.black_box, has_effects))
    return " ".join(doubt for doubt in doubts if doubt)


def _make_answer_sections(findings: Findings) -> list[Section]:
    """Make the section on the named effects: one point each, what remains and the next experiment; or none."""
    effects = findings.diagnosis.effects
    if not effects:
        return []
    points = [
        " ".join(filter(None, (_describe_effect(findings, effect), describe_equivalents(effect)))) for effect in effects
    ]
    closing_sentences = [
        describe_remainder(findings.diagnosis, extract_device(findings)),
        describe_next_experiment(findings.diagnosis),
    ]
    return [Section("What the model lacks", points=(*points, *filter(None, closing_sentences)))]


def _compare_with_black_box(findings: Findings) -> tuple[str, ...]:
    """Write the sentences that compare the prediction with that of a black-box model."""
    comparison_text = describe_black_box(findings.black_box, bool(findings.diagnosis.effects))
    return tuple(filter(None, (*describe_balance_errors(findings.balance_errors), comparison_text)))


_NO_MAP_SENTENCE = "There is no map: the noise of this recording is not known."


def _make_localisation_section(findings: Findings, pictures: Sequence[Picture]) -> Section:
    """Make the section on the map of the mismatch, with its largest entries before any effect is added."""
    sentences = write_localisation_sentences(findings.localisation) if findings.maps else (_NO_MAP_SENTENCE,)
    table = tabulate_mismatches("The places that differ most, as given", findings.diagnosis.mismatch, findings.is_timed)
    return Section(
        "Where model and device disagree",
        paragraphs=sentences,
        pictures=(*_select_pictures(pictures, "state"), *_select_pictures(pictures, "mismatch-map")),
        tables=(table,),
    )


def _make_effect_section(findings: Findings, effect_index: int, pictures: Sequence[Picture]) -> Section:
    """Make the section on the effect with this index (from 0): equation, source, rivals, signature curves and
    parameters."""
    effect = findings.diagnosis.effects[effect_index]
    fitted_effect, force_unit = find_fitted_effect(findings, effect), typeset_unit(findings.given.system.force)
    paragraphs = [describe_share(effect)]
    if fitted_effect is not None:
        # The equation of a law has the numbers from which its fit started.
        equation = fitted_effect.effect.equation if effect.law is None else format_law(effect.law, force_unit)
        paragraphs += [f"Equation: {equation}.", f"Source: {fitted_effect.effect.source}."]
    rivals = describe_rivals(effect)
    if not rivals and not describe_equivalents(effect):
        paragraphs.append("No rival fits nearly as well.")
    return Section(
        capitalise(format_effect_title(effect, findings.given.inputs == 1)),
        paragraphs=tuple(paragraphs),
        pictures=_select_signatures(findings, effect, pictures),
        tables=(tabulate_parameters(effect), *((tabulate_rivals(effect),) if effect.rivals else ())),
    )


def _select_signatures(findings: Findings, effect: NamedEffect, pictures: Sequence[Picture]) -> tuple[Picture, ...]:
    """Select the signature pictures of the effect: those at its axis, or all of them where it has none there."""
    effect_numbers = [
        number for number, signature in enumerate(findings.signatures, start=1) if signature.effect == effect.effect
    ]
    axis_numbers = [number for number in effect_numbers if findings.signatures[number - 1].axis == effect.axis]
    names = {f"signature-{number}" for number in (axis_numbers or effect_numbers)}
    return tuple(picture for picture in pictures if picture.name in names)


def _make_error_section(findings: Findings, pictures: Sequence[Picture]) -> Section:
    """Make the section on the prediction errors, in all and by channel, on held-out and on fitted data."""
    tables: list[Table] = [tabulate_errors(findings)]
    tables += [table for part in ("test", "fit") if (table := tabulate_channel_errors(findings, part)) is not None]
    return Section("How well it predicts", pictures=_select_pictures(pictures, "held-out"), tables=tuple(tables))


def _make_remainder_section(findings: Findings, pictures: Sequence[Picture]) -> Section:
    """Make the section on the mismatch that remains with all named effects."""
    remainder = findings.diagnosis.remainder
    tables = (tabulate_mismatches("Remaining mismatch", remainder, findings.is_timed),) if remainder else ()
    return Section(
        "What is still unexplained",
        paragraphs=(describe_remainder(findings.diagnosis, extract_device(findings)),),
        pictures=_select_pictures(pictures, "remainder"),
        tables=tables,
    )


_UNMOVED_SENTENCES = {
    False: "No parameter changed by more than the standard deviation of its calibration.",
    True: "No parameter changed by more than the tolerance of the first fit.",
}
"""Sentence where no parameter was re-tuned beyond its tolerance, by whether the model was fitted to the recordings."""


def _make_parameter_section(findings: Findings) -> Section:
    """Make the section on the parameters of the model itself: those that were re-tuned, and the doubtful ones."""
    moved_parameters = find_final_moves(findings)
    retuning_text = describe_retuning(moved_parameters, findings.fitted) or _UNMOVED_SENTENCES[findings.fitted]
    table = tabulate_retuned(findings)
    return Section(
        "The model's own parameters",
        paragraphs=(retuning_text,),
        points=describe_doubtful_parameters(moved_parameters, findings.fitted),
        tables=(table,) if table is not None else (),
    )


def _describe_effect(findings: Findings, effect: NamedEffect) -> str:
    """Describe a named effect with the text on its signature, if it has one."""
    return describe_effect(effect, get_signature_text(findings, effect), extract_device(findings))


def _select_pictures(pictures: Sequence[Picture], kind: str) -> tuple[Picture, ...]:
    """Select the pictures named `kind`, or `kind` with a suffix after a hyphen."""
    return tuple(picture for picture in pictures if picture.name == kind or picture.name.startswith(f"{kind}-"))
