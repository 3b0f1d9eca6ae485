"""Report of a folder of real recordings: named effects, residuals, and an expert's objections."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from analysis.diagnosis.real_answer.real_answer import OwnParameter, PairOutcome, RealAnswer
from analysis.diagnosis.unit_wording import error_text, value_text
from analysis.evaluation.blind_test.injected import InjectedOutcome
from analysis.figures.diagnosis.real_held_out import error_rows
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

    where: str
    why: str


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
            Section("What could not be used", points=tuple(f"{trouble.where}: {trouble.why}" for trouble in troubles))
        )
    sections += [_section(answer, pictures.get((answer.folder, answer.recording))) for answer in answers]
    if injected:
        sections.append(make_injected_section(injected))
    named = sum(bool(answer.effects) for answer in answers)
    return render_page(
        Page(
            title="Diagnosis of real recordings",
            summary=f"{len(answers)} recordings of real devices were compared with simple models; in {named} of them "
            "physics was named. The remaining error and the objections to each answer are given with it.",
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
    return Table("Errors on held-out data, shares of the signal", header, tuple(_row(answer) for answer in answers))


def _row(real_answer: RealAnswer) -> tuple[str, ...]:
    errors = real_answer.held_out
    shown = (
        ("", "", "", "") if errors is None else tuple(map(error_text, (errors.before, errors.retuned, errors.noise)))
    )
    before, retuned, noise = shown[:3]
    after = error_text(errors.after) if errors is not None and real_answer.effects else "-"
    named = ", ".join(real_answer.effects) or _first_candidate(real_answer) or "-"
    box = "-" if real_answer.black_box is None else error_text(real_answer.black_box)
    return (
        _title(real_answer), VERDICT_WORDS[real_answer.verdict], named,
        before, retuned, after, box, noise, f"{real_answer.seconds:.0f}",
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


def _section(real_answer: RealAnswer, picture: Picture | None) -> Section:
    points = (
        *real_answer.where,
        *real_answer.named,
        *(parameter_sentence(number) for number in real_answer.numbers),
        *_pair_points(real_answer.pair),
    )
    further = tuple(_further_sentence(*test) for test in _further_tests(real_answer))
    objections = tuple(f"An expert would object: {objection}" for objection in real_answer.objections)
    paragraphs = (
        *((real_answer.title,) if real_answer.title else ()),
        real_answer.answer,
        *((f"The simple model: {real_answer.model}",) if real_answer.model else ()),
        *((f"Errors are measured by {real_answer.error}.",) if real_answer.error else ()),
        *((real_answer.left,) if real_answer.left else ()),
    )
    return Section(
        _title(real_answer),
        paragraphs=paragraphs,
        points=(*points, *real_answer.not_confirmed, *further, *real_answer.remarks, *objections),
        pictures=(picture,) if picture is not None and error_rows(real_answer) else (),
        tables=_tables(real_answer),
    )


def _tables(real_answer: RealAnswer) -> tuple[Table, ...]:
    every = (*real_answer.stretches, *(each for test in real_answer.further for each in test.stretches))
    if not every:
        return ()
    rows = tuple(
        (
            f"{each.record}, {each.channel}, {each.start_s:.4g} to {each.stop_s:.4g} s",
            value_text(each.signal, each.unit),
            value_text(each.retuned, each.unit),
            value_text(each.after, each.unit),
            f"{each.after / each.retuned:.2f}" if each.retuned > 0 else "-",
        )
        for each in every
    )
    header = ("held-out stretch", "signal", "re-tuned", "with the effects found", "ratio")
    return (Table("Root-mean-square errors, stretch by stretch", header, rows),)


def parameter_sentence(number: OwnParameter) -> str:
    """Sentence that compares a fitted parameter of the model with its value known by other means, where there is such a
    value."""
    ends = None if number.low is None or number.high is None else (number.low, number.high)
    text = f"The model's {number.name} is {value_text(number.value, number.unit, ends)} after everything"
    if number.nominal is None:
        return f"{text}."
    off = 100 * (number.value / number.nominal - 1)
    inside = {True: ", and the interval holds it", False: ", and the interval does not hold it", None: ""}
    known = value_text(number.nominal, number.unit)
    return f"{text}; known by other means is {known}, {typeset(f'{off:+.2g}')} % off{inside[number.holds_nominal]}."


def _pair_points(pair: PairOutcome | None) -> tuple[str, ...]:
    if pair is None:
        return ()
    named = ", ".join(pair.named) if pair.named else "no effect of the catalogue"
    return (
        f"A change that was really made: {pair.changed} ({pair.before}, then {pair.after}). What the model missed "
        f"before the change, {error_text(pair.expected_left)} of the signal, counts as no mismatch.",
        f"Named as the change: {named}. Errors after it on held-out data: the model of before as it is "
        f"{error_text(pair.as_before)}, with one factor re-tuned {error_text(pair.gain)}, re-tuned within its "
        f"tolerances {error_text(pair.retuned)}, with what is named {error_text(pair.with_effects)}.",
    )


def _further_tests(real_answer: RealAnswer) -> list[tuple[str, str, float | None, float | None, str]]:
    return [(each.recording, each.error, each.retuned, each.after, each.problem) for each in real_answer.further]


def _further_sentence(recording: str, error: str, retuned: float | None, after: float | None, problem: str) -> str:
    if problem:
        return f"A further test, {recording}, could not be made: {problem}"
    return (
        f"A further test, {recording}, nothing fitted to it, by {error}: re-tuned {error_text(retuned)}, with what was "
        f"found {error_text(after)}."
    )


def _title(real_answer: RealAnswer) -> str:
    """A folder's only recording is often called like it."""
    return (
        real_answer.recording
        if real_answer.recording == real_answer.folder
        else f"{real_answer.folder}: {real_answer.recording}"
    )
