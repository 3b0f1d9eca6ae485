"""What is said of a folder of real recordings at the end, in lines."""

from analysis.diagnosis.real_answer.real_answer import RealAnswer
from analysis.diagnosis.unit_wording import error_text
from analysis.evaluation.proof.injected import injected_figures
from analysis.reports.injected_section import figure_text
from analysis.reports.real_report import VERDICT_WORDS
from study.evaluation.real.write_real import WrittenReal


def real_lines(done: WrittenReal) -> tuple[str, ...]:
    results = done.results
    troubles = tuple(f"Could not be used: {one.where}: {one.why}" for one in results.troubles)
    figures = injected_figures(results.injected) if results.injected else ()
    counted = tuple(f"Injected: {one.name}: {figure_text(one)}" for one in figures)
    lines = (*(_line(one) for one in results.answers), *troubles, *counted)
    return (*lines, "", f"Page: {done.page}", f"Table: {done.table}")


def _line(one: RealAnswer) -> str:
    named = f": {', '.join(one.effects)}" if one.effects else ""
    if one.verdict == "unexplained" and one.candidates:
        named = f", best candidate (not confirmed) {one.candidates[0].effect}"
    said = f"{one.folder}, {one.recording}: {VERDICT_WORDS[one.verdict]}{named}"
    if one.held_out is None:
        return f"{said}. {one.answer}"
    errors = one.held_out
    after = f", with what was found {error_text(errors.after)}" if one.effects else ""
    box = "" if one.black_box is None else f", black box {error_text(one.black_box)}"
    return (
        f"{said}. Held out: as given {error_text(errors.before)}, re-tuned {error_text(errors.retuned)}{after}{box} "
        f"({one.seconds:.0f} s)."
    )
