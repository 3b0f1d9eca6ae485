"""Whether a code may begin a session: one code is one person, or one simulated participant, and nobody who withdrew."""

from pathlib import Path

from study.errors import StudyError, WrongUseError
from study.store.sessions.archive import SessionFolder, session_folders
from study.workflows.results.fold_session import fold_session
from study.workflows.session.participant_number import begun_in


def check_code(data: Path, subject: str, simulated: bool) -> None:
    """Raises WrongUseError where the code belongs to somebody else."""
    for folder in _folders(data, subject):
        if folder.withdrawn:
            raise WrongUseError(
                f"{subject} withdrew",
                f"The participant of {folder.name} withdrew, and the data were erased.",
                "Use a new code: this one is not given again.",
            )
        begun = begun_in(folder)
        if begun is not None and begun.simulated != simulated:
            whose, other = ("a person", "simulated") if simulated else ("a simulated participant", "a person's")
            raise WrongUseError(
                f"{subject} is the code of {whose}",
                f"{folder.name} holds sessions of {whose}; {other} answers must not be filed under it.",
                "Use another code (--subject), or another data folder (--data).",
            )


def unfinished_sessions(data: Path, subject: str, protocol: str) -> tuple[SessionFolder, ...]:
    """Sessions of the same participant and protocol that could be resumed."""
    return tuple(folder for folder in _folders(data, subject) if _can_go_on(folder, protocol))


def _folders(data: Path, subject: str) -> tuple[SessionFolder, ...]:
    return tuple(folder for folder in session_folders(data) if folder.subject == subject)


def _can_go_on(folder: SessionFolder, protocol: str) -> bool:
    try:
        state = fold_session(folder).state
    except StudyError:
        return False
    return not state.closed and not state.sitting.turned_away and state.protocol.name == protocol
