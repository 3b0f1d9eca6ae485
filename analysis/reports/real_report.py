"""HTML report of a folder of real recordings: the diagnosis of each recording, what could not be used, and tests with
an injected effect.

Per recording: verdict, named effects, fitted parameters, errors on held-out data, and the objections an expert may
raise. Begin with `render_real_report`.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from analysis.diagnosis.real_answer.real_answer import FurtherTest, OwnParameter, PairOutcome, RealAnswer
from analysis.diagnosis.unit_wording import format_error, format_value
from analysis.evaluation.blind_test.injected_faults import InjectedOutcome
from analysis.figures.diagnosis.real_held_out import list_error_rows
from analysis.figures.picture import Picture
from analysis.reports.injected_section import make_injected_section
from analysis.reports.page import Page, Section, Table, drop_empty, render_page
from analysis.wording import typeset

VERDICT_WORDS = {
    "no_mismatch": "no mismatch",
    "parameters": "parameters alone",
    "explained": "explained",
    "partly_explained": "partly explained",
    "unexplained": "unexplained",
    "refused": "refused",
}
"""Words for the verdict, by `RealAnswer.verdict`."""


@dataclass(frozen=True, slots=True)
class UnusableInput:
    """A folder of recordings that could not be used."""

    location: str
    """Name of the sub-folder, or of the folder itself where it has no sub-folders."""
    reason: str
    """The reason, as a sentence."""


def render_real_report(
    answers: Sequence[RealAnswer],
    unusable_inputs: Sequence[UnusableInput],
    injected_outcomes: Sequence[InjectedOutcome],
    pictures: Mapping[tuple[str, str], Picture],
    provenance: Mapping[str, str],
    generated: str,
) -> str:
    """Render the report as an HTML page. injected_outcomes: diagnoses of recordings with an injected effect; empty: the
    section is left out. pictures: by folder and recording; a missing picture is left out. provenance: versions and
    inputs by name. generated: local time of the report."""
    unusable_points = tuple(f"{unusable.location}: {unusable.reason}" for unusable in unusable_inputs)
    sections = [
        Section("All recordings", tables=(make_overview_table(answers),)),
        *drop_empty(Section("What could not be used", points=unusable_points)),
        *(_make_recording_section(answer, pictures.get((answer.folder, answer.recording))) for answer in answers),
    ]
    if injected_outcomes:
        sections.append(make_injected_section(injected_outcomes))
    named_count = sum(bool(answer.effects) for answer in answers)
    return render_page(
        Page(
            title="Diagnosis of real recordings",
            summary=f"Recordings of real devices that were compared with simple models: {len(answers)}. Recordings in "
            f"which physics was named: {named_count}. The remaining error and the objections to each answer are given "
            "with it.",
            banner=_describe_unusable_inputs(unusable_inputs),
            sections=tuple(sections),
            generated=generated,
            provenance=provenance,
        )
    )


def make_overview_table(answers: Sequence[RealAnswer]) -> Table:
    """Make the table of all recordings: verdict, named effects, held-out errors as shares of the signal, and duration
    of the diagnosis in s."""
    named_headings = ("recording", "verdict", "named")
    error_headings = ("as given", "re-tuned", "with the effects found", "black box", "noise")
    rows = tuple(_format_overview_row(answer) for answer in answers)
    return Table("Errors on held-out data, shares of the signal", (*named_headings, *error_headings, "s"), rows)


def _format_overview_row(real_answer: RealAnswer) -> tuple[str, ...]:
    """Format the row of a recording. A dash stands for the error with effects where no effect is named or nothing was
    held out, and for that of the black box where it was not computed; the other errors are empty where nothing was held
    out."""
    errors = real_answer.held_out
    error_texts = (
        ("", "", "", "") if errors is None else tuple(map(format_error, (errors.before, errors.retuned, errors.noise)))
    )
    before_text, retuned_text, noise_text = error_texts[:3]
    after_text = format_error(errors.after) if errors is not None and real_answer.effects else "-"
    effect_names = ", ".join(real_answer.effects) or _describe_first_candidate(real_answer) or "-"
    black_box_text = "-" if real_answer.black_box is None else format_error(real_answer.black_box)
    return (
        _format_recording_title(real_answer), VERDICT_WORDS[real_answer.verdict], effect_names,
        before_text, retuned_text, after_text, black_box_text, noise_text, f"{real_answer.seconds:.0f}",
    )  # fmt: skip


def _describe_first_candidate(real_answer: RealAnswer) -> str:
    """Describe the best candidate that was not confirmed, where the verdict is "unexplained"; else empty."""
    return (
        f"not confirmed: {real_answer.candidates[0].effect}"
        if real_answer.candidates and real_answer.verdict == "unexplained"
        else ""
    )


def _describe_unusable_inputs(unusable_inputs: Sequence[UnusableInput]) -> str:
    """Describe in a sentence how many inputs could not be used, for the banner; empty where there are none."""
    if not unusable_inputs:
        return ""
    return f"Folders or files that could not be used: {len(unusable_inputs)}. The reasons are below."


def _make_recording_section(real_answer: RealAnswer, picture: Picture | None) -> Section:
    """Make the section of one recording. The picture is left out where the answer has no rows of errors to draw."""
    points = (
        *real_answer.where,
        *real_answer.named,
        *(describe_parameter(parameter) for parameter in real_answer.numbers),
        *_describe_pair(real_answer.pair),
    )
    further_sentences = tuple(map(_describe_further_test, real_answer.further))
    objections = tuple(f"An expert would object: {objection}" for objection in real_answer.objections)
    paragraphs = (
        *((real_answer.title,) if real_answer.title else ()),
        real_answer.answer,
        *((f"The simple model: {real_answer.model}",) if real_answer.model else ()),
        *((f"Errors are measured by {real_answer.error}.",) if real_answer.error else ()),
        *((real_answer.left,) if real_answer.left else ()),
    )
    return Section(
        _format_recording_title(real_answer),
        paragraphs=paragraphs,
        points=(*points, *real_answer.not_confirmed, *further_sentences, *real_answer.remarks, *objections),
        pictures=(picture,) if picture is not None and list_error_rows(real_answer) else (),
        tables=_make_stretch_tables(real_answer),
    )


def _make_stretch_tables(real_answer: RealAnswer) -> tuple[Table, ...]:
    """Make the table of root-mean-square errors by held-out stretch and channel, those of further tests included; empty
    without stretches. The ratio is a dash where the re-tuned model has no error."""
    held_out_stretches = (
        *real_answer.stretches,
        *(stretch for test in real_answer.further for stretch in test.stretches),
    )
    if not held_out_stretches:
        return ()
    rows = tuple(
        (
            f"{stretch.record}, {stretch.channel}, {stretch.start_s:.4g} to {stretch.stop_s:.4g} s",
            format_value(stretch.signal, stretch.unit),
            format_value(stretch.retuned, stretch.unit),
            format_value(stretch.after, stretch.unit),
            f"{stretch.after / stretch.retuned:.2f}" if stretch.retuned > 0 else "-",
        )
        for stretch in held_out_stretches
    )
    header = ("held-out stretch", "signal", "re-tuned", "with the effects found", "ratio")
    return (Table("Root-mean-square errors, stretch by stretch", header, rows),)


def describe_parameter(parameter: OwnParameter) -> str:
    """Describe a fitted parameter of the model in a sentence, with its 95 % interval where both ends are known and with
    the value known by other means, if any; the deviation in % is left out where that value is 0."""
    interval = None if parameter.low is None or parameter.high is None else (parameter.low, parameter.high)
    value_text = (
        f"The model's {parameter.name} is {format_value(parameter.value, parameter.unit, interval)} after the last fit"
    )
    if parameter.nominal is None:
        return f"{value_text}."
    deviation_text = ""
    if parameter.nominal:
        deviation_percent = 100 * (parameter.value / parameter.nominal - 1)
        deviation_text = f", {typeset(f'{deviation_percent:+.2g}')} % off"
    interval_clauses = {True: ", and the interval holds it", False: ", and the interval does not hold it", None: ""}
    nominal_text = format_value(parameter.nominal, parameter.unit)
    return (
        f"{value_text}; known by other means is {nominal_text}{deviation_text}"
        f"{interval_clauses[parameter.holds_nominal]}."
    )


def _describe_pair(pair: PairOutcome | None) -> tuple[str, ...]:
    """Describe the comparison of the device before and after a change that was really made, as sentences; empty without
    one."""
    if pair is None:
        return ()
    effect_names = ", ".join(pair.named) if pair.named else "no effect of the catalogue"
    return (
        f"A change that was really made: {pair.changed} ({pair.before}, then {pair.after}). What the model missed "
        f"before the change, {format_error(pair.expected_left)} of the signal, counts as no mismatch.",
        f"Named as the change: {effect_names}. Held-out errors after it: the model from before, unchanged, "
        f"{format_error(pair.as_before)}, with one factor re-tuned {format_error(pair.gain)}, re-tuned within its "
        f"tolerances {format_error(pair.retuned)}, with what is named {format_error(pair.with_effects)}.",
    )


def _describe_further_test(test: FurtherTest) -> str:
    """Describe a further test in a sentence: its errors as shares of the signal, of the re-tuned model and with the
    named effects, or the problem for which it could not be made."""
    if test.problem:
        return f"A further test, {test.recording}, could not be made: {test.problem}"
    return (
        f"A further test, {test.recording}, nothing fitted to it, by {test.error}: re-tuned "
        f"{format_error(test.retuned)}, with what was found {format_error(test.after)}."
    )


def _format_recording_title(real_answer: RealAnswer) -> str:
    """Format folder and name of a recording, or the name alone where both are the same."""
    return (
        real_answer.recording
        if real_answer.recording == real_answer.folder
        else f"{real_answer.folder}: {real_answer.recording}"
    )
