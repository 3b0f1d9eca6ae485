"""Session folders within the data folder of a study: naming, creation, search, and paths of the files in them.

A folder is named by participant code and session number, as in `P01_001`. Folders of withdrawn sessions remain, with a
tombstone (a small file that states the withdrawal) in place of the data, so that their numbers are not used again.
"""

import contextlib
import os
import re
import shlex
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from study.errors import StudyError, WrongUseError
from study.session.views.participant_codes import CODE_RULE, is_code
from study.store.disk.atomic_write import sync_folder
from study.store.disk.privacy import PRIVATE_FOLDER, make_folder, restrict_data_folder
from study.store.sessions.event_log import LOG_NAME

FOLDER_PATTERN = re.compile(r"(?P<subject>[A-Za-z0-9]{1,16})_(?P<number>\d{3,})")
"""Pattern of a session folder's name: participant code (1 to 16 letters or digits), underscore, session number (three
digits or more)."""
TOMBSTONE_NAME = "withdrawn.json"
"""File that replaces the data in each session folder of a withdrawn participant."""
WITHDRAWN_CLAUSE = "was withdrawn by the participant"
"""Statement on a withdrawn session, after its name, in analyses made since: no more than its tombstone states."""


@dataclass(frozen=True, slots=True)
class SessionFolder:
    """Folder of a session, named by participant code and session number, and the paths of its files."""

    path: Path

    @property
    def name(self) -> str:
        """Name of the session, as in P01_001."""
        return self.path.name

    @property
    def subject(self) -> str:
        """Participant code."""
        return self.name.rpartition("_")[0]

    @property
    def log(self) -> Path:
        """Path of the event log."""
        return self.path / LOG_NAME

    @property
    def recordings(self) -> Path:
        """Folder of the session's recordings."""
        return self.path / "recordings"

    @property
    def tombstone(self) -> Path:
        """Path of the tombstone, which only a withdrawal writes."""
        return self.path / TOMBSTONE_NAME

    @property
    def withdrawal(self) -> Path:
        """Path of the withdrawal record, which exists while the erasing of this participant's sessions is
        unfinished."""
        return locate_withdrawal_record(self.path.parent, self.subject)

    @property
    def withdrawn(self) -> bool:
        """Whether the session was withdrawn, or its withdrawal has begun; False where its folder cannot be read, so
        that reading the log reports that."""
        # The tombstone is written before the record is erased: in the other order, a withdrawal could end in between.
        return os.path.exists(self.withdrawal) or os.path.exists(self.tombstone)  # noqa: PTH110 - Path.exists raises

    @property
    def erasure_status(self) -> str:
        """Whether a withdrawal has erased all data, as a clause for messages."""
        return "not all data are erased yet" if self.withdrawal.exists() else "the data were erased"


def locate_withdrawal_record(data: Path, subject: str) -> Path:
    """Return the path of the withdrawal record of a participant; the file need not exist."""
    return data / f"{subject}.withdrawal.json"


class SessionWithdrawnError(StudyError):
    """The session was withdrawn. Its data must not be used, even if some of them are not erased yet."""

    def __init__(self, folder: SessionFolder) -> None:
        super().__init__(
            "This session was withdrawn",
            f"The participant of {folder.name} withdrew; {folder.erasure_status}.",
            f"Nothing can be done with it; {shlex.join(('hapteq', 'validate', str(folder.path)))} says whether "
            "anything remains.",
        )


def require_consent(folders: Iterable[SessionFolder]) -> None:
    """Raise StudyError where a session was withdrawn while its data were analysed or exported: the withdrawal may not
    have found what was written in the meantime."""
    for folder in folders:
        if folder.withdrawn:
            raise StudyError(
                "A participant withdrew in the meantime",
                f"{folder.name} was withdrawn while its data were read.",
                "Run the same command again: it leaves this session out.",
                saved="Nothing of this run was kept.",
            )


def list_linked_sessions(folders: Iterable[SessionFolder]) -> tuple[Path, ...]:
    """List the sessions that are symbolic links: their participants withdraw in the data folder to which they lead."""
    return tuple(folder.path for folder in folders if folder.path.is_symlink())


def check_subject(code: str) -> str:
    """Return the participant code if it is valid (`is_code`); otherwise raise WrongUseError, so that names of persons
    and e-mail addresses do not become names of folders."""
    if not is_code(code):
        raise WrongUseError(
            "This is no participant code",
            f"'{code}' was given; {CODE_RULE}.",
            "Use the code from your list; names, initials with dots and e-mail addresses stay off this computer.",
        )
    return code


def create_session_folder(data: Path, subject: str) -> SessionFolder:
    """Create the participant's next session folder, numbered from 1. An existing folder is never used, even if two
    programs create one at the same time; a name that is taken otherwise (by a file, a dangling link, or another case of
    the letters where the file system ignores it) is skipped. Raises WrongUseError for an invalid code, StudyError if
    the folder cannot be created, or the next 1000 names (chosen) are taken."""
    check_subject(subject)
    try:
        is_new = not data.exists()
        make_folder(data, private=True)
        restrict_data_folder(data)
        used_numbers = [
            parse_session_number(session_folder.name)
            for session_folder in list_session_folders(data)
            if session_folder.subject == subject
        ]
        first_number = max(used_numbers, default=0) + 1
        for number in range(first_number, first_number + 1000):
            path = data / f"{subject}_{number:03d}"
            try:
                path.mkdir(mode=PRIVATE_FOLDER)
            except FileExistsError:
                continue
            (path / "recordings").mkdir(mode=PRIVATE_FOLDER)
            for folder in (path, data):
                sync_folder(folder)
            if is_new:
                with contextlib.suppress(OSError):  # the parent folder may not be readable
                    sync_folder(data.absolute().parent)
            return SessionFolder(path)
    except OSError as error:
        raise StudyError(
            "The session folder cannot be made",
            f"In {data}: {error.strerror}.",
            "Choose another folder with --data, or make room and check its permissions.",
        ) from error
    raise StudyError(
        "The session folder cannot be made",
        f"In {data}, 1000 names from {subject}_{first_number:03d} on are taken by something else than a session.",
        "Look at them, or choose another folder with --data.",
    )


def list_session_folders(data: Path) -> tuple[SessionFolder, ...]:
    """List all session folders in the data folder, withdrawn ones included, in alphabetical order; empty without that
    folder. A folder without log and tombstone is listed where its name has a participant code: results_2026 has none.
    """
    if not data.is_dir():
        return ()
    folders = (SessionFolder(path) for path in sorted(data.iterdir()))
    return tuple(
        folder
        for folder in folders
        if folder.path.is_dir()
        and FOLDER_PATTERN.fullmatch(folder.name)
        and (is_code(folder.subject) or holds_session(folder.path))
    )


def holds_session(folder: Path) -> bool:
    """Whether a folder is that of a session: it has the name of one, and a log or a tombstone. The name alone does not
    prove it: an analysis may be called results_2026, a data folder study_001."""
    session_folder = SessionFolder(folder)
    return FOLDER_PATTERN.fullmatch(folder.name) is not None and any(
        os.path.lexists(path) for path in (session_folder.log, session_folder.tombstone)
    )


def parse_session_number(name: str) -> int:
    """Parse the session number in a folder's name; 0 if the name is not that of a session folder."""
    match = FOLDER_PATTERN.fullmatch(name)
    return int(match["number"]) if match else 0


def is_session_name(name: str, subject: str) -> bool:
    """Whether the name is that of a session folder of this participant."""
    match = FOLDER_PATTERN.fullmatch(name)
    return match is not None and match["subject"] == subject


def require_single_folder(session: str, data: Path) -> None:
    """Raise WrongUseError where both the current folder and the data folder hold a folder of this name: a command must
    not change, or erase, the session of another study. `.` and `..` are paths, and mean the session alone."""
    here, there = Path(session), data / session
    if here.name not in ("", "..") and here.is_dir() and there.is_dir() and not here.samefile(there):
        raise WrongUseError(
            "Two sessions have this name",
            f"{here.resolve()} and {there.resolve()} could both be meant.",
            "Give the path of the session's folder.",
            saved="Nothing was changed.",
        )


def find_session(session: str, data: Path) -> SessionFolder:
    """Find a session by the path of its folder or by its name within `data`. Raises SessionWithdrawnError for a
    withdrawn session, WrongUseError if there is no such folder with an event log, or two."""
    require_single_folder(session, data)
    folders = [SessionFolder(path.resolve()) for path in (Path(session), data / session)]
    for folder in folders:
        if folder.withdrawn:
            raise SessionWithdrawnError(folder)
        if folder.log.exists():
            return folder
    for folder in folders:
        if FOLDER_PATTERN.fullmatch(folder.name) and folder.path.is_dir():
            raise WrongUseError(
                "This session has no log",
                f"{folder.path} holds no {LOG_NAME}: the program died while it was made, or the log was removed.",
                f"If it holds recordings or tables, restore {LOG_NAME} from a copy; otherwise begin a new session.",
            )
    session_names = (
        ", ".join(session_folder.name for session_folder in list_session_folders(data) if not session_folder.withdrawn)
        or "none"
    )
    raise WrongUseError(
        "There is no such session",
        f"'{session}' is neither a session folder nor the name of one in {data}. Sessions there: {session_names}.",
        "Give the folder, or its name together with --data.",
    )
