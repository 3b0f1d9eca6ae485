"""Withdrawal: erase a participant's data for good, and leave a tombstone.

The tombstone keeps the session's name, the protocol's, and the place in its balanced order: nothing measured.
"""

import shutil
from dataclasses import asdict, dataclass
from pathlib import Path

from study.errors import StudyError
from study.store.archive import TOMBSTONE_NAME, SessionFolder, session_folders
from study.store.event_log import nobody_writes
from study.store.json_document import write_json
from study.store.session_lock import LOCK_NAME, locked
from study.workflows.analysis_files import ANALYSIS_NAME, written_by_analysis
from study.workflows.participant_number import TOMBSTONE_FORMAT, TOMBSTONE_VERSION, begun_in


@dataclass(frozen=True, slots=True)
class Withdrawal:
    subject: str
    sessions: tuple[str, ...]
    """All sessions of the participant in this data folder, those withdrawn before included."""
    analysis: Path | None
    """The folder's analysis, which holds the participant's numbers and curves too."""


def plan_withdrawal(session: SessionFolder) -> Withdrawal:
    """What would be erased: every session of the same participant beside this one."""
    names = tuple(f.name for f in session_folders(session.path.parent) if f.subject == session.subject)
    analysis = session.path.parent / ANALYSIS_NAME
    return Withdrawal(session.subject, names, analysis if analysis.is_dir() else None)


def withdraw(data: Path, withdrawal: Withdrawal, utc: str) -> None:
    """Erase. The tombstone is written first, so that an interrupted withdrawal is known and can be repeated."""
    for name in withdrawal.sessions:
        folder = SessionFolder(data / name)
        with locked(folder.path), nobody_writes(folder.log):
            _erase(folder, utc)
    if withdrawal.analysis is not None:
        _erase_analysis(withdrawal.analysis)


def _erase(folder: SessionFolder, utc: str) -> None:
    try:
        if not folder.withdrawn:
            begun = begun_in(folder)
            left = {"session": folder.name, "withdrawn_utc": utc, "begun": asdict(begun) if begun else None}
            write_json(folder.tombstone, TOMBSTONE_FORMAT, TOMBSTONE_VERSION, left)
        for path in folder.path.iterdir():
            if path.name in (TOMBSTONE_NAME, LOCK_NAME):
                continue
            if path.is_dir():
                shutil.rmtree(path)
            else:
                path.unlink()
    except OSError as problem:
        raise StudyError(
            "Not everything could be erased",
            f"In {folder.name}: {problem.strerror}.",
            "Mend the permissions and run the same command again; it goes on where it stopped.",
        ) from problem


def _erase_analysis(folder: Path) -> None:
    """Only what an analysis writes: what else lies there is somebody's own."""
    try:
        for path in written_by_analysis(folder):
            path.unlink()
        for emptied in (folder / "figures", folder):
            if emptied.is_dir() and not any(emptied.iterdir()):
                emptied.rmdir()
    except OSError as problem:
        raise StudyError(
            "Not everything could be erased",
            f"The analysis in {folder} is still there: {problem.strerror}.",
            "Mend the permissions and erase it by hand, or run the same command again.",
            saved="The sessions are erased.",
        ) from problem
