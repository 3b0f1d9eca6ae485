"""Status of a session in the list of past sessions: a symbol with a word, and a sentence.

The word differs between states, so that the status can be read without seeing colour.
"""

from study.session.views.archive_views import INELIGIBILITY_REASONS, SessionLine, SessionStatus
from study.session.views.count_text import format_count

_SYMBOLS_AND_STYLES: dict[SessionStatus, tuple[str, str]] = {
    "finished": ("✓", "$text-success"),
    "unfinished": ("◐", "$text-warning"),
    "running": ("▶", "bold $text-accent"),
    "refused": ("○", "$foreground 65%"),
    "excluded": ("○", "$foreground 65%"),
    "withdrawn": ("✕", "$foreground 65%"),
    "unreadable": ("!", "$text-error"),
}
"""Symbol of a status, and the Textual style of symbol and word, with theme variables."""


def format_status(status: SessionStatus) -> str:
    """Format a status as symbol and word."""
    return f"{_SYMBOLS_AND_STYLES[status][0]} {status}"


def find_status_style(status: SessionStatus) -> str:
    """Find the Textual style of a status."""
    return _SYMBOLS_AND_STYLES[status][1]


def describe_session(session: SessionLine) -> str:
    """Describe the status of a session in words; for an unfinished or running one, also what can be done with it."""
    run_count, answer_count = format_count(session.runs, "run"), format_count(session.answers, "answer")
    match session.standing:
        case "finished":
            return f"{_format_session_name(session)} finished all {run_count} with {answer_count}."
        case "unfinished":
            progress_text = f"{session.runs_done} of {run_count} done, {answer_count}"
            device_text = f" on the {session.device}" if session.device else ""
            return f"{_format_session_name(session)} is not finished: {progress_text}. It can be resumed{device_text}."
        case "running":
            return f"{_format_session_name(session)} is running now in another program. You can watch it."
        case "refused" | "excluded":
            return f"{session.name} is over: {INELIGIBILITY_REASONS[session.standing]}. The person does not take part."
        case "withdrawn":
            return f"{session.subject}: {session.remark or 'the participant withdrew; the data were erased.'}"
        case "unreadable":
            return f"{session.name} cannot be read. {session.remark}".rstrip()


def _format_session_name(session: SessionLine) -> str:
    """Format the name of a session, with its simulated participant if it has one."""
    return f"{session.name}{f' (simulated: {session.observer})' if session.observer else ''}"
