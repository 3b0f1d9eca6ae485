"""Other sessions of a participant that contribute to the vibration dose of the hand."""

from study.errors import StudyError
from study.session.facts.sitting_events import DoseElsewhere
from study.session.state.daily_dose import dose_elsewhere
from study.session.state.sitting_state import SittingState
from study.store.sessions.archive import SessionFolder, session_folders
from study.workflows.results.fold_session import fold_session


def dose_before(folder: SessionFolder, observer: str | None, simulated: bool, utc: str) -> DoseElsewhere | None:
    """Dose that this participant's hand got today in other sessions of the data folder on the same kind of device.

    An unreadable session is named and not counted. None for a simulated participant.
    """
    if observer is not None:
        return None
    sittings: dict[str, SittingState] = {}
    unread: list[str] = []
    for other in session_folders(folder.path.parent):
        if other.subject != folder.subject:
            continue
        try:
            if other.withdrawn or not other.log.exists():
                continue
            state = fold_session(other).state
        except (StudyError, OSError):
            unread.append(other.name)
            continue
        if state.opened.observer is None and state.opened.device.simulated == simulated:
            sittings[other.name] = state.sitting
    return dose_elsewhere(sittings, folder.name, utc, tuple(unread))
