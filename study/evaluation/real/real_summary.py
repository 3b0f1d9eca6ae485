"""Lines for the terminal that summarise the diagnosis of a folder of real recordings (`hapteq real`)."""

from analysis.diagnosis.real_answer.real_answer import RealAnswer
from analysis.diagnosis.unit_wording import error_text
from analysis.evaluation.blind_test.injected import injected_figures
from analysis.reports.injected_section import figure_text
from analysis.reports.real_report import VERDICT_WORDS
from study.evaluation.real.write_real import WrittenReal


def real_lines(done: WrittenReal) -> tuple[str, ...]:
    """Lines for the terminal: an answer per recording, what could not be used, injected faults, and the paths
    written."""
    results = done.results
    troubles = tuple(f"Could not be used: {trouble.where}: {trouble.why}" for trouble in results.troubles)
    figures = injected_figures(results.injected) if results.injected else ()
    counted = tuple(f"Injected: {figure.name}: {figure_text(figure)}" for figure in figures)
    lines = (*(_line(answer) for answer in results.answers), *troubles, *counted)
    return (*lines, "", f"Page: {done.page}", f"Table: {done.table}")


def _line(real_answer: RealAnswer) -> str:
    """One recording: verdict, effects, held-out errors as fractions of the signal (model as given, re-tuned, with the
    effects, black box), and duration in seconds; the answer in words where no error was measured."""
    named = f": {', '.join(real_answer.effects)}" if real_answer.effects else ""
    if real_answer.verdict == "unexplained" and real_answer.candidates:
        named = f", best candidate (not confirmed) {real_answer.candidates[0].effect}"
    text = f"{real_answer.folder}, {real_answer.recording}: {VERDICT_WORDS[real_answer.verdict]}{named}"
    if real_answer.held_out is None:
        return f"{text}. {real_answer.answer}"
    errors = real_answer.held_out
    after = f", with what was found {error_text(errors.after)}" if real_answer.effects else ""
    box = "" if real_answer.black_box is None else f", black box {error_text(real_answer.black_box)}"
    return (
        f"{text}. Held out: as given {error_text(errors.before)}, re-tuned {error_text(errors.retuned)}{after}{box} "
        f"({real_answer.seconds:.0f} s)."
    )
