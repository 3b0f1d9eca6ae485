"""Withdrawal: erase a participant's data for good, and leave a tombstone that says so and nothing else."""

import shutil
from dataclasses import dataclass
from pathlib import Path

from study.errors import StudyError
from study.store.archive import TOMBSTONE_NAME, SessionFolder, session_folders
from study.store.json_document import write_json
from study.store.session_lock import LOCK_NAME, locked

FORMAT = "hapteq-tombstone"
VERSION = 1


@dataclass(frozen=True, slots=True)
class Withdrawal:
    subject: str
    sessions: tuple[str, ...]
    """All sessions of the participant in this data folder, those withdrawn before included."""


def plan_withdrawal(session: SessionFolder) -> Withdrawal:
    """What would be erased: every session of the same participant beside this one."""
    names = tuple(f.name for f in session_folders(session.path.parent) if f.subject == session.subject)
    return Withdrawal(session.subject, names)


def withdraw(data: Path, withdrawal: Withdrawal, utc: str) -> None:
    """Erase. The tombstone is written first, so that an interrupted withdrawal is known and can be repeated."""
    for name in withdrawal.sessions:
        folder = SessionFolder(data / name)
        with locked(folder.path):
            _erase(folder, utc)


def _erase(folder: SessionFolder, utc: str) -> None:
    try:
        if not folder.withdrawn:
            write_json(folder.tombstone, FORMAT, VERSION, {"session": folder.name, "withdrawn_utc": utc})
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
