"""Plan a sitting: read the protocol, draw the seed, check the model and the participant code, find unfinished sessions.

Errors in these are raised here, before a device is opened or a session folder is created.
"""

from dataclasses import dataclass
from pathlib import Path

from study.errors import StudyError, WrongUseError
from study.session.views.resume_command import format_logged_resume_command
from study.store.disk.privacy import format_data_folder_warning
from study.store.formats.protocol_files import read_study_protocol
from study.store.sessions.archive import SessionFolder, check_subject, list_session_folders
from study.workflows.results.fold_session import fold_session
from study.workflows.session.equalize_stimuli import check_model_for_protocol
from study.workflows.session.open_session import SessionPlan, draw_seed
from study.workflows.session.participant_number import read_begun_participant


def check_participant_code(data: Path, subject: str, simulated: bool) -> None:
    """Check that a participant code can be used for a new session. Raises WrongUseError if its participant withdrew or,
    by an existing session, is of the other kind (person or simulated)."""
    for folder in _list_participant_folders(data, subject):
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


def find_unfinished_sessions(data: Path, subject: str, protocol_name: str) -> tuple[SessionFolder, ...]:
    """Find the sessions of this participant code and protocol name that can be resumed, in order of their folders."""
    return tuple(folder for folder in _list_participant_folders(data, subject) if _is_resumable(folder, protocol_name))


def _list_participant_folders(data: Path, subject: str) -> tuple[SessionFolder, ...]:
    """List the session folders of a participant code."""
    return tuple(folder for folder in list_session_folders(data) if folder.subject == subject)


def _is_resumable(folder: SessionFolder, protocol_name: str) -> bool:
    """Whether the session can be read, follows the protocol of this name, is not closed, and its participant was
    neither excluded nor refused."""
    try:
        state = fold_session(folder).state
    except StudyError:
        return False
    return not state.closed and not state.sitting.ineligibility and state.protocol.name == protocol_name


@dataclass(frozen=True, slots=True)
class SittingPlan:
    """Plan of a new session, and remarks about it."""

    session: SessionPlan
    notes: tuple[str, ...]
    """Sentences for the experimenter."""


def plan_sitting(
    protocol_name: str, subject: str, observer: str | None, seed: int | None, data: Path, model: Path | None = None
) -> SittingPlan:
    """Plan a new session, with a note on each unfinished one. protocol_name: name or path; subject: participant
    code; observer: name of a simulated participant, None for a person; seed: None = a new random one; data: data
    folder; model: file of the identified model for equalization. Raises StudyError if the sitting cannot begin."""
    protocol_source = read_study_protocol(protocol_name, data)
    plan = SessionPlan(
        protocol=protocol_source.protocol,
        protocol_text=protocol_source.text,
        protocol_locked=protocol_source.locked,
        subject=check_subject(subject),
        observer=observer,
        seed=draw_seed() if seed is None else seed,
        data_folder=data,
        model=model,
    )
    check_model_for_protocol(plan.protocol, model)
    check_participant_code(data, plan.subject, simulated=observer is not None)
    unfinished_notes = (
        f"{folder.name} is not finished; {_format_resume_command(folder)} continues it."
        for folder in find_unfinished_sessions(data, plan.subject, protocol_source.protocol.name)
    )
    return SittingPlan(plan, (*unfinished_notes, *filter(None, [format_data_folder_warning(data)])))


def _format_resume_command(folder: SessionFolder) -> str:
    """Format the command that continues an unfinished session on the device on which it was begun."""
    device = fold_session(folder).state.opened.device
    return format_logged_resume_command(str(folder.path), device.name, device.simulated)
