"""Vibration dose of a participant's hand from other sessions in the data folder, for the daily exposure limit."""

from study.errors import StudyError
from study.session.facts.sitting_events import DoseElsewhere
from study.session.state.daily_dose import find_dose_elsewhere
from study.session.state.sitting_state import SittingState
from study.store.sessions.archive import SessionFolder, list_session_folders
from study.workflows.results.fold_session import fold_session


def compute_other_session_dose(
    folder: SessionFolder, observer: str | None, simulated: bool, utc: str
) -> DoseElsewhere | None:
    """Compute the dose from this participant's other sessions since the last rest of a night's length (see
    `find_dose_elsewhere`). None for a simulated participant, and where no other session counts and all could be read.

    folder: of the session. observer: name of the simulated participant; None: a person. simulated: whether
    the device is simulated; only sessions on the same kind of device count. utc: present time (ISO 8601). A session
    that cannot be read is named in the result and not counted.
    """
    if observer is not None:
        return None
    sittings: dict[str, SittingState] = {}
    unread_names: list[str] = []
    for other_folder in list_session_folders(folder.path.parent):
        if other_folder.subject != folder.subject:
            continue
        try:
            if other_folder.withdrawn or not other_folder.log.exists():
                continue
            state = fold_session(other_folder).state
        except (StudyError, OSError):
            unread_names.append(other_folder.name)
            continue
        if state.opened.observer is None and state.opened.device.simulated == simulated:
            sittings[other_folder.name] = state.sitting
    return find_dose_elsewhere(sittings, folder.name, utc, tuple(unread_names))
