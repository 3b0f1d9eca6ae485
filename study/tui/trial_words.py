"""Position in a session in words, for line mode and screens: runs and counts, which do not reveal levels."""

from typing import Literal

from protocols.trial import Phase
from study.session.views.views import Progress, Question, Task, Welcome

WITHDRAW = "withdraw"
"""Must be typed completely: a single key must not erase a session."""


def heading(question: Question) -> str:
    """Run and trial number."""
    again = ", once more" if question.repeated else ""
    return (
        f"{run_name(question)} {question.run_number} of {question.runs_in_phase}, trial {question.trial_number}{again}"
    )


def run_name(question: Question) -> str:
    if question.practice:
        return "Practice"
    if question.task is Task.INTERVAL:
        return "Interval run"
    return "Training" if question.phase is Phase.TRAINING else "Run"


def progress_sentence(progress: Progress) -> str:
    left = ""
    if progress.minutes_left is not None:
        left = f", about {progress.minutes_left} minute{'s' if progress.minutes_left != 1 else ''} left"
    return f"{progress.share_done:.0%} of the session is done{left}."


def runs_left(runs: int) -> str:
    return "1 run is left." if runs == 1 else f"{runs} runs are left."


def plan(notice: Welcome) -> str:
    runs = f"{notice.runs} run{'s' if notice.runs != 1 else ''}"
    if notice.training_runs and notice.runs:
        return f"There is some training first, then {runs} with rests between them."
    return f"There {'are' if notice.runs != 1 else 'is'} {runs}." if notice.runs else "This is a training session."


def refusal_words(outcome: Literal["refused", "excluded"]) -> tuple[str, ...]:
    """Last words to a person who does not take part."""
    kept = "Nothing was played, and only this is kept."
    if outcome == "refused":
        return ("Thank you for coming. You decided not to take part, and that is fine.", kept)
    return (
        "Thank you for coming. With one of your answers you cannot take part in this study.",
        f"{kept} Which answer it was is not kept. The experimenter can tell you more.",
    )
