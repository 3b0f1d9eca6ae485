"""Report of a folder of real recordings: named effects, residuals, and an expert's objections."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from analysis.diagnosis.real_answer.real_answer import OwnParameter, PairOutcome, RealAnswer
from analysis.diagnosis.unit_wording import format_error, format_value
from analysis.evaluation.blind_test.injected import InjectedOutcome
from analysis.figures.diagnosis.real_held_out import list_error_rows
from analysis.figures.picture import Picture
from analysis.reports.injected_section import make_injected_section
from analysis.reports.page import Page, Section, Table, render_page
from analysis.wording import typeset

VERDICT_WORDS = {
    "no_mismatch": "no mismatch",
    "parameters": "parameters alone",
    "explained": "explained",
    "partly_explained": "partly explained",
    "unexplained": "unexplained",
    "refused": "refused",
}


@dataclass(frozen=True, slots=True)
class Trouble:
    """A folder or file that could not be used."""

    location: str
    reason: str


def render_real_report(
    answers: Sequence[RealAnswer],
    troubles: Sequence[Trouble],
    injected: Sequence[InjectedOutcome],
    pictures: Mapping[tuple[str, str], Picture],
    provenance: Mapping[str, str],
    generated: str,
) -> str:
    """HTML. pictures: by folder and recording."""
    sections = [Section("All recordings", tables=(overview_table(answers),))]
    if troubles:
        sections.append(
            Section(
                "What could not be used", points=tuple(f"{trouble.location}: {trouble.reason}" for trouble in troubles)
            )
        )
    sections += [_recording_section(answer, pictures.get((answer.folder, answer.recording))) for answer in answers]
    if injected:
        sections.append(make_injected_section(injected))
    named_count = sum(bool(answer.effects) for answer in answers)
    return render_page(
        Page(
            title="Diagnosis of real recordings",
            summary=f"{len(answers)} recordings of real devices were compared with simple models; in {named_count} of "
            "them physics was named. The remaining error and the objections to each answer are given with it.",
            banner=_banner(troubles),
            sections=tuple(sections),
            generated=generated,
            provenance=provenance,
        )
    )


def overview_table(answers: Sequence[RealAnswer]) -> Table:
    """Table of all recordings: verdict, named effects, held-out errors of each model as shares of the signal, and
    seconds."""
    header = (
        "recording",
        "verdict",
        "named",
        "as given",
        "re-tuned",
        "with the effects found",
        "black box",
        "noise",
        "s",
    )
    return Table(
        "Errors on held-out data, shares of the signal", header, tuple(_overview_row(answer) for answer in answers)
    )


def _overview_row(real_answer: RealAnswer) -> tuple[str, ...]:
    errors = real_answer.held_out
    error_texts = (
        ("", "", "", "") if errors is None else tuple(map(format_error, (errors.before, errors.retuned, errors.noise)))
    )
    before_text, retuned_text, noise_text = error_texts[:3]
    after_text = format_error(errors.after) if errors is not None and real_answer.effects else "-"
    effect_names = ", ".join(real_answer.effects) or _first_candidate(real_answer) or "-"
    black_box_text = "-" if real_answer.black_box is None else format_error(real_answer.black_box)
    return (
        _recording_title(real_answer), VERDICT_WORDS[real_answer.verdict], effect_names,
        before_text, retuned_text, after_text, black_box_text, noise_text, f"{real_answer.seconds:.0f}",
    )  # fmt: skip


def _first_candidate(real_answer: RealAnswer) -> str:
    return (
        f"not confirmed: {real_answer.candidates[0].effect}"
        if real_answer.candidates and real_answer.verdict == "unexplained"
        else ""
    )


def _banner(troubles: Sequence[Trouble]) -> str:
    if not troubles:
        return ""
    return f"{len(troubles)} folders or files could not be used; they are named below."


def _recording_section(real_answer: RealAnswer, picture: Picture | None) -> Section:
    points = (
        *real_answer.where,
        *real_answer.named,
        *(parameter_sentence(number) for number in real_answer.numbers),
        *_pair_points(real_answer.pair),
    )
    further_sentences = tuple(_further_sentence(*test) for test in _further_tests(real_answer))
    objections = tuple(f"An expert would object: {objection}" for objection in real_answer.objections)
    paragraphs = (
        *((real_answer.title,) if real_answer.title else ()),
        real_answer.answer,
        *((f"The simple model: {real_answer.model}",) if real_answer.model else ()),
        *((f"Errors are measured by {real_answer.error}.",) if real_answer.error else ()),
        *((real_answer.left,) if real_answer.left else ()),
    )
    return Section(
        _recording_title(real_answer),
        paragraphs=paragraphs,
        points=(*points, *real_answer.not_confirmed, *further_sentences, *real_answer.remarks, *objections),
        pictures=(picture,) if picture is not None and list_error_rows(real_answer) else (),
        tables=_stretch_tables(real_answer),
    )


def _stretch_tables(real_answer: RealAnswer) -> tuple[Table, ...]:
    stretches = (*real_answer.stretches, *(stretch for test in real_answer.further for stretch in test.stretches))
    if not stretches:
        return ()
    rows = tuple(
        (
            f"{stretch.record}, {stretch.channel}, {stretch.start_s:.4g} to {stretch.stop_s:.4g} s",
            format_value(stretch.signal, stretch.unit),
            format_value(stretch.retuned, stretch.unit),
            format_value(stretch.after, stretch.unit),
            f"{stretch.after / stretch.retuned:.2f}" if stretch.retuned > 0 else "-",
        )
        for stretch in stretches
    )
    header = ("held-out stretch", "signal", "re-tuned", "with the effects found", "ratio")
    return (Table("Root-mean-square errors, stretch by stretch", header, rows),)


def parameter_sentence(parameter: OwnParameter) -> str:
    """Sentence that compares a fitted parameter of the model with its value known by other means, where there is such a
    value."""
    interval = None if parameter.low is None or parameter.high is None else (parameter.low, parameter.high)
    text = f"The model's {parameter.name} is {format_value(parameter.value, parameter.unit, interval)} after everything"
    if parameter.nominal is None:
        return f"{text}."
    deviation_percent = 100 * (parameter.value / parameter.nominal - 1)
    interval_words = {True: ", and the interval holds it", False: ", and the interval does not hold it", None: ""}
    nominal_text = format_value(parameter.nominal, parameter.unit)
    return (
        f"{text}; known by other means is {nominal_text}, {typeset(f'{deviation_percent:+.2g}')} % off"
        f"{interval_words[parameter.holds_nominal]}."
    )


def _pair_points(pair: PairOutcome | None) -> tuple[str, ...]:
    if pair is None:
        return ()
    effect_names = ", ".join(pair.named) if pair.named else "no effect of the catalogue"
    return (
        f"A change that was really made: {pair.changed} ({pair.before}, then {pair.after}). What the model missed "
        f"before the change, {format_error(pair.expected_left)} of the signal, counts as no mismatch.",
        f"Named as the change: {effect_names}. Errors after it on held-out data: the model of before as it is "
        f"{format_error(pair.as_before)}, with one factor re-tuned {format_error(pair.gain)}, re-tuned within its "
        f"tolerances {format_error(pair.retuned)}, with what is named {format_error(pair.with_effects)}.",
    )


def _further_tests(real_answer: RealAnswer) -> list[tuple[str, str, float | None, float | None, str]]:
    return [(test.recording, test.error, test.retuned, test.after, test.problem) for test in real_answer.further]


def _further_sentence(recording: str, error: str, retuned: float | None, after: float | None, problem: str) -> str:
    if problem:
        return f"A further test, {recording}, could not be made: {problem}"
    return (
        f"A further test, {recording}, nothing fitted to it, by {error}: re-tuned {format_error(retuned)}, with what "
        f"was found {format_error(after)}."
    )


def _recording_title(real_answer: RealAnswer) -> str:
    """A folder's only recording is often called like it."""
    return (
        real_answer.recording
        if real_answer.recording == real_answer.folder
        else f"{real_answer.folder}: {real_answer.recording}"
    )
