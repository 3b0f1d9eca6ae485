"""Format the lines that `hapteq real` prints: a summary of the diagnosis of a folder of real recordings."""

from analysis.diagnosis.real_answer.real_answer import RealAnswer
from analysis.diagnosis.unit_wording import format_error
from analysis.evaluation.blind_test.injected_faults import score_injections
from analysis.reports.injected_section import format_rate
from analysis.reports.real_report import VERDICT_WORDS
from study.evaluation.real.write_real import WrittenReal


def format_real_lines(written_results: WrittenReal) -> tuple[str, ...]:
    """Format the lines: an answer per recording, unusable sub-folders with the reason, rates of injected faults that
    were found, and the paths of page and table."""
    results = written_results.results
    troubles = tuple(f"Could not be used: {trouble.location}: {trouble.reason}" for trouble in results.troubles)
    figures = score_injections(results.injected) if results.injected else ()
    injected_lines = tuple(f"Injected: {figure.name}: {format_rate(figure)}" for figure in figures)
    lines = (*(_format_answer(answer) for answer in results.answers), *troubles, *injected_lines)
    return (*lines, "", f"Page: {written_results.page}", f"Table: {written_results.table}")


def _format_answer(real_answer: RealAnswer) -> str:
    """Format the line of one recording: verdict, effects (or the best candidate of an unexplained recording), held-out
    errors relative to the signal (model as given, re-tuned, with the effects, black box), and duration (s); the answer
    in words where no error was measured."""
    effects_text = f": {', '.join(real_answer.effects)}" if real_answer.effects else ""
    if real_answer.verdict == "unexplained" and real_answer.candidates:
        effects_text = f", best candidate (not confirmed) {real_answer.candidates[0].effect}"
    answer_text = f"{real_answer.folder}, {real_answer.recording}: {VERDICT_WORDS[real_answer.verdict]}{effects_text}"
    if real_answer.held_out is None:
        return f"{answer_text}. {real_answer.answer}"
    errors = real_answer.held_out
    with_effects_text = f", with what was found {format_error(errors.after)}" if real_answer.effects else ""
    black_box_text = "" if real_answer.black_box is None else f", black box {format_error(real_answer.black_box)}"
    return (
        f"{answer_text}. Held out: as given {format_error(errors.before)}, re-tuned {format_error(errors.retuned)}"
        f"{with_effects_text}{black_box_text} ({real_answer.seconds:.0f} s)."
    )
