"""Status of a session in the list of past sessions: a symbol with a word, and a sentence.

Symbol and word differ between states, so that the status can be read without seeing colour. Used by the
screens of sessions and by `hapteq sessions`.
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


def format_status(status: SessionStatus) -> str:
    """Format a status as symbol and word."""
    return f"{SYMBOLS[status]} {status}"


def describe_session(line: SessionLine) -> str:
    """Describe a session of the list in one or two sentences, and what can be done with it."""
    match line.standing:
        case "finished":
            return (
                f"{_format_session_name(line)} finished all {_format_run_count(line.runs)} "
                f"with {_format_answer_count(line)}."
            )
        case "unfinished":
            progress_text = f"{line.runs_done} of {_format_run_count(line.runs)} done, {_format_answer_count(line)}"
            return f"{_format_session_name(line)} is not finished: {progress_text}. It can be resumed."
        case "running":
            return f"{_format_session_name(line)} is running now in another program. You can watch it."
        case "refused" | "excluded":
            return f"{line.name} is over: {INELIGIBILITY_REASONS[line.standing]}. The person does not take part."
        case "withdrawn":
            return f"{line.subject}: {line.remark or 'the participant withdrew; the data were erased.'}"
        case "unreadable":
            return f"{line.name} cannot be read. {line.remark}".rstrip()


def _format_session_name(line: SessionLine) -> str:
    """Format the name of a session, with its simulated participant if it has one."""
    return f"{line.name}{f' (simulated: {line.observer})' if line.observer else ''}"


def _format_answer_count(line: SessionLine) -> str:
    """Format the number of answers with its noun."""
    return f"{line.answers} answer{'' if line.answers == 1 else 's'}"


def _format_run_count(run_count: int) -> str:
    """Format a number of runs with its noun."""
    return f"{run_count} run{'' if run_count == 1 else 's'}"
