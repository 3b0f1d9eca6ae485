"""Plan of a sitting: read the protocol, check the model and the participant code, draw the seed.

Errors in these are raised here, before a device is opened or a session folder is created.
"""

from dataclasses import dataclass
from pathlib import Path

from study.errors import StudyError, WrongUseError
from study.store.disk.privacy import format_data_folder_warning
from study.store.formats.protocol_files import read_study_protocol
from study.store.sessions.archive import SessionFolder, check_subject, list_session_folders
from study.workflows.results.fold_session import fold_session
from study.workflows.session.equalize_stimuli import check_model_for_protocol
from study.workflows.session.open_session import SessionPlan, draw_seed
from study.workflows.session.participant_number import read_begun_participant


def check_code(data: Path, subject: str, simulated: bool) -> None:
    """Raise WrongUseError if the participant code is of a participant who withdrew or, by an existing session, of a
    participant of the other kind (person or simulated)."""
    for folder in _folders(data, subject):
        if folder.withdrawn:
            raise WrongUseError(
                f"{subject} withdrew",
                f"The participant of {folder.name} withdrew, and {folder.erasure_status}.",
                "Use a new code: this one is not given again.",
            )
        participant = read_begun_participant(folder)
        if participant is not None and participant.simulated != simulated:
            existing_kind, new_kind = (
                ("a person", "simulated") if simulated else ("a simulated participant", "a person's")
            )
            raise WrongUseError(
                f"{subject} is the code of {existing_kind}",
                f"{folder.name} holds sessions of {existing_kind}; {new_kind} answers must not be filed under it.",
                "Use another code (--subject), or another data folder (--data).",
            )


def find_unfinished_sessions(data: Path, subject: str, protocol: str) -> tuple[SessionFolder, ...]:
    """Sessions of this participant and protocol that can be resumed."""
    return tuple(folder for folder in _folders(data, subject) if _is_resumable(folder, protocol))


def _folders(data: Path, subject: str) -> tuple[SessionFolder, ...]:
    """Session folders of a participant code."""
    return tuple(folder for folder in list_session_folders(data) if folder.subject == subject)


def _is_resumable(folder: SessionFolder, protocol: str) -> bool:
    """Whether the session can be read, follows this protocol, and is neither closed nor refused."""
    try:
        state = fold_session(folder).state
    except StudyError:
        return False
    return not state.closed and not state.sitting.ineligibility and state.protocol.name == protocol


@dataclass(frozen=True, slots=True)
class SittingPlan:
    """Plan of a new session, and remarks about it."""

    session: SessionPlan
    notes: tuple[str, ...]
    """Sentences to show before the session begins."""


def plan_sitting(
    protocol_name: str, subject: str, observer: str | None, seed: int | None, data: Path, model: Path | None = None
) -> SittingPlan:
    """The plan. subject: participant code; observer: name of a simulated participant, None for a person; seed: None = a
    new random one. Raises StudyError if the sitting cannot begin."""
    source = read_study_protocol(protocol_name, data)
    plan = SessionPlan(
        protocol=source.protocol,
        protocol_text=source.text,
        protocol_locked=source.locked,
        subject=check_subject(subject),
        observer=observer,
        seed=draw_seed() if seed is None else seed,
        data_folder=data,
        model=model,
    )
    check_model_for_protocol(plan.protocol, model)
    check_code(data, plan.subject, simulated=observer is not None)
    unfinished_before = (
        f"{unfinished.name} is not finished; hapteq resume {unfinished.path} continues it."
        for unfinished in find_unfinished_sessions(data, plan.subject, source.protocol.name)
    )
    return SittingPlan(plan, (*unfinished_before, *filter(None, [format_data_folder_warning(data)])))
