"""Status of a session in the list of past sessions: a symbol with a word, and a sentence.

Symbol and word differ between states, so that the status can be read without seeing colour.
"""

from study.session.views.archive_views import INELIGIBILITY_REASONS, SessionLine, SessionStatus

SYMBOLS: dict[SessionStatus, str] = {
    "finished": "✓",
    "unfinished": "◐",
    "running": "▶",
    "refused": "○",
    "excluded": "○",
    "withdrawn": "✕",
    "unreadable": "!",
}
"""Symbol of each status, a single character."""

STYLES: dict[SessionStatus, str] = {
    "finished": "$text-success",
    "unfinished": "$text-warning",
    "running": "bold $text-accent",
    "refused": "$foreground 65%",
    "excluded": "$foreground 65%",
    "withdrawn": "$foreground 65%",
    "unreadable": "$text-error",
}
"""Style of symbol and word for each status, in Textual's notation."""


def status_text(standing: SessionStatus) -> str:
    """Symbol and word of a status."""
    return f"{SYMBOLS[standing]} {standing}"


def describe(line: SessionLine) -> str:
    """One or two sentences about a session in a list, and what can be done with it."""
    match line.standing:
        case "finished":
            return f"{_observer_text(line)} finished all {_runs(line.runs)} with {_answers(line)}."
        case "unfinished":
            done = f"{line.runs_done} of {_runs(line.runs)} done, {_answers(line)}"
            return f"{_observer_text(line)} is not finished: {done}. It can be resumed."
        case "running":
            return f"{_observer_text(line)} is running now in another program. You can watch it."
        case "refused" | "excluded":
            return f"{line.name} is over: {INELIGIBILITY_REASONS[line.standing]}. The person does not take part."
        case "withdrawn":
            return f"{line.subject}: {line.remark or 'the participant withdrew; the data were erased.'}"
        case "unreadable":
            return f"{line.name} cannot be read. {line.remark}".rstrip()


def _observer_text(line: SessionLine) -> str:
    return f"{line.name}{f' (simulated: {line.observer})' if line.observer else ''}"


def _answers(line: SessionLine) -> str:
    return f"{line.answers} answer{'' if line.answers == 1 else 's'}"


def _runs(runs: int) -> str:
    return f"{runs} run{'' if runs == 1 else 's'}"
