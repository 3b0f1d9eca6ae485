"""Withdraw a participant: erase the data that are proved to be the participant's, and replace each session by a
tombstone (`hapteq withdraw`).

A tombstone is a file with the names of session and protocol and the participant number, but without measured data. The
list of what will be erased is written to the disk first, and the log of each session is erased last, so that the same
command continues an interrupted withdrawal.
"""

import errno
import os
from collections.abc import Iterable
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from study.errors import StudyError, WrongUseError
from study.store.disk.file_errors import CannotWriteError, NotSyncedError
from study.store.disk.real_folder import OpenedFolder, is_real_file, is_real_folder, open_folder
from study.store.sessions.archive import (
    FOLDER_PATTERN,
    TOMBSTONE_NAME,
    SessionFolder,
    locate_withdrawal_record,
    require_single_folder,
)
from study.store.sessions.event_log import LOG_NAME, hold_log_lock
from study.store.sessions.session_lock import SESSION_LOCK_NAME, hold_session_lock
from study.store.sessions.withdrawal_files import (
    WithdrawalIntent,
    format_withdraw_command,
    read_intent,
    write_intent,
    write_tombstone,
)
from study.store.sessions.written_elsewhere import read_written_folders
from study.workflows.session.participant_number import read_begun_participant
from study.workflows.session.participant_traces import UNFINISHED_PATTERN, find_traces, is_subject_in_analysis

COPIES_REMINDER = "Analyses written elsewhere with --out, and copies, still hold the numbers: erase them."
"""Reminder of copies that the program cannot find, for messages."""


@dataclass(frozen=True, slots=True)
class Withdrawal:
    """Plan of a withdrawal: the data that are erased in the data folder, and those that a person must check."""

    subject: str
    """Code of the participant."""
    sessions: tuple[str, ...]
    """Names of the proved sessions of the participant in this data folder, earlier withdrawn ones included."""
    derived: tuple[str, ...]
    """Paths of analyses and unfinished files with the participant's data, relative to the data folder."""
    doubtful: tuple[str, ...]
    """Sentences on data that may be the participant's; they are kept and must be checked by a person."""

    @property
    def derived_roots(self) -> tuple[str, ...]:
        """First part of each path in `derived`, without repetition: the entries of the data folder that contain
        them."""
        return tuple(dict.fromkeys(PurePosixPath(name).parts[0] for name in self.derived))


def find_session_to_withdraw(session: str, data: Path) -> SessionFolder:
    """Find the session by the path of its folder or by its name in `data`; it may be withdrawn already. Raises
    WrongUseError for an unknown session, one of two of this name, and a symbolic link, which is not followed."""
    require_single_folder(session, data)
    path = Path(session) if Path(session).is_dir() else data / session
    folder = SessionFolder(path.absolute().parent.resolve() / path.absolute().name)
    if folder.path.is_symlink():
        raise WrongUseError(
            "This session is a link",
            f"{folder.name} leads to another place, where nothing is erased.",
            "Give the session's real folder.",
            saved="Nothing was changed.",
        )
    has_session_name = FOLDER_PATTERN.fullmatch(folder.name) is not None
    if not has_session_name or not (is_real_folder(folder.path) or is_real_file(folder.withdrawal)):
        raise WrongUseError(
            "There is no such session", f"'{session}' was not found in {data}.", "Give its folder, or --data."
        )
    return folder


def plan_withdrawal(session: SessionFolder) -> Withdrawal:
    """Plan the withdrawal of the session's participant: all proved sessions, and analyses that name the participant;
    includes the plan of a withdrawal that was interrupted. Nothing is changed. Raises StudyError where no session is
    proved to be the participant's and no withdrawal was begun."""
    data, subject = session.path.parent.resolve(), session.subject
    intent = read_intent(data, subject)
    traces = find_traces(data, subject, intent.sessions if intent else ())
    derived = (*traces.derived, *(intent.derived if intent else ()))
    if not traces.sessions and intent is None:
        raise StudyError(
            "Nothing was erased",
            f"No folder in {data} is proved to hold a session of {subject}. {' '.join(traces.doubtful)}".rstrip(),
            "Look at what is named here, and erase by hand what is the participant's.",
            saved="Nothing was changed.",
        )
    return Withdrawal(subject, traces.sessions, tuple(dict.fromkeys(derived)), traces.doubtful)


def withdraw(data: Path, withdrawal: Withdrawal, utc: str) -> Withdrawal:
    """Erase the data of the plan, and those that were written since it was made, and write the tombstones. Returns what
    was erased. utc: time of the withdrawal, not used if an interrupted one is continued. Raises StudyError: before any
    data are erased if a session is running; at any time where the operating system does not allow to erase or write a
    file."""
    data, subject = data.resolve(), withdrawal.subject
    try:
        with ExitStack() as locks, open_folder(data) as data_folder:
            _lock_for_erasing(data, withdrawal.sessions, locks)
            _write_intent(data, withdrawal, utc)
            # The intent keeps analyses and exports from being finished: what was finished before it is found now.
            erased = _add_to_plan(withdrawal, plan_withdrawal(SessionFolder(data / f"{subject}_001")))
            _lock_for_erasing(data, erased.sessions[len(withdrawal.sessions) :], locks)
            intent = _write_intent(data, erased, utc)
            for name in erased.derived:
                _erase_derived(data_folder, name)
            for name, participant in intent.sessions.items():
                _erase_session(data_folder, SessionFolder(data / name))
                write_tombstone(SessionFolder(data / name), intent.withdrawn_utc, participant)
            data_folder.sync()
            data_folder.erase(locate_withdrawal_record(data, subject).name)
            data_folder.sync()
    except OSError as problem:
        raise _make_incomplete_error(data, withdrawal, problem) from problem
    except (CannotWriteError, NotSyncedError) as failure:
        raise _make_incomplete_error(data, withdrawal, failure.problem) from failure
    return erased


def list_remaining_copies(data: Path, withdrawal: Withdrawal) -> tuple[str, ...]:
    """List the analyses and exports that a withdrawal does not search and that name or may name the participant, a
    sentence each, as far as their folders were recorded when they were written (`note_written_folder`); the last
    sentence is a reminder of other copies."""
    naming_paths = [path for path in _find_copies(data) if _may_name(path, withdrawal.subject)]
    return (*(f"Written with --out, and not erased: {path}" for path in naming_paths), COPIES_REMINDER)


def _find_copies(data: Path) -> tuple[Path, ...]:
    """Find the recorded folders that exist, the unfinished ones of interrupted exports beside them, and what is
    recorded in these folders in turn: analyses of an export."""
    found: dict[Path, None] = {}
    unread = [data]
    while unread:
        for recorded in read_written_folders(unread.pop()):
            for path in (recorded, *_list_unfinished(recorded)):
                if path not in found and not _is_gone(path):
                    found[path] = None
                    unread.append(path)
    return tuple(found)


def _list_unfinished(folder: Path) -> list[Path]:
    """List the unfinished folders beside this one, which an interrupted export to it left (`create_new_folder`)."""
    try:
        entries = sorted(folder.parent.iterdir())
    except OSError:  # their folder cannot be seen: `folder` is named all the same
        return []
    unfinished = ((entry, UNFINISHED_PATTERN.fullmatch(entry.name)) for entry in entries)
    return [entry for entry, name_match in unfinished if name_match and name_match["name"] == folder.name]


def _is_gone(path: Path) -> bool:
    """Whether there is nothing at the path; False where that cannot be seen."""
    try:
        path.lstat()
    except OSError as problem:
        return isinstance(problem, FileNotFoundError | NotADirectoryError)
    return False


def _may_name(path: Path, subject: str) -> bool:
    """Whether the analysis or export in a folder names the subject, or it cannot be determined."""
    try:
        return is_subject_in_analysis(path, subject) is not False
    except OSError:
        return True


def _write_intent(data: Path, withdrawal: Withdrawal, utc: str) -> WithdrawalIntent:
    """Write the intent of this plan; an earlier intent keeps its time. Returns it. Raises as `write_intent`."""
    earlier_intent = read_intent(data, withdrawal.subject)
    intent = WithdrawalIntent(
        withdrawal.subject,
        earlier_intent.withdrawn_utc if earlier_intent else utc,
        {name: read_begun_participant(SessionFolder(data / name)) for name in withdrawal.sessions},
        withdrawal.derived,
    )
    if intent != earlier_intent:
        write_intent(data, intent)
    return intent


def _add_to_plan(plan: Withdrawal, later_plan: Withdrawal) -> Withdrawal:
    """Add what a later plan found, after what the first plan has."""
    return Withdrawal(
        plan.subject,
        tuple(dict.fromkeys((*plan.sessions, *later_plan.sessions))),
        tuple(dict.fromkeys((*plan.derived, *later_plan.derived))),
        later_plan.doubtful,
    )


def _lock_for_erasing(data: Path, names: Iterable[str], locks: ExitStack) -> None:
    """Lock sessions and their logs until `locks` is closed. Raises OSError unless real folders are at their paths, and
    StudyError if a session is running, which also says whether the withdrawal has begun, and gives its command: in a
    sitting no command was typed."""
    for folder in (SessionFolder(data / name) for name in names):
        if not is_real_folder(folder.path):
            raise NotADirectoryError(errno.ENOTDIR, os.strerror(errno.ENOTDIR), folder.name)
        lock_path = folder.path / SESSION_LOCK_NAME
        if lock_path.is_symlink():
            lock_path.unlink()
        try:
            locks.enter_context(hold_session_lock(folder.path))
            if is_real_file(folder.log):
                locks.enter_context(hold_log_lock(folder.log))
        except StudyError as error:
            error.do_now = f"{error.do_now} Then erase with: {format_withdraw_command(folder)}"
            if is_real_file(folder.withdrawal):
                error.saved = f"Nothing was erased now, but no session of {folder.subject} counts as data any more."
            raise


def _erase_session(data: OpenedFolder, folder: SessionFolder) -> None:
    """Erase all files of the session except its lock and tombstone; the log last, after the other changes were synced
    to the disk."""
    with open_folder(data, folder.name) as session_folder:
        for name in session_folder.list_names():
            if name not in (TOMBSTONE_NAME, SESSION_LOCK_NAME, LOG_NAME):
                session_folder.erase(name)
        session_folder.sync()
        session_folder.erase(LOG_NAME)
        session_folder.sync()


def _erase_derived(data: OpenedFolder, relative_path: str) -> None:
    """Erase a file or folder, and those of its parent folders below the data folder that become empty. relative_path:
    path relative to the data folder."""
    *parents, last_part = PurePosixPath(relative_path).parts
    try:
        with open_folder(data, *parents) as parent_folder:
            parent_folder.erase(last_part)
            parent_folder.sync()
    except (FileNotFoundError, NotADirectoryError):
        return  # already erased, or a folder was replaced by a link: links are not followed
    while parents:
        *parents, last_part = parents
        with open_folder(data, *parents) as parent_folder:
            parent_folder.erase_if_empty(last_part)


def _make_incomplete_error(data: Path, withdrawal: Withdrawal, problem: OSError) -> StudyError:
    """Make the error for a withdrawal that the operating system did not allow to complete, with the command that
    continues it."""
    file_text = f" ({problem.filename})" if problem.filename else ""
    session_name = withdrawal.sessions[0] if withdrawal.sessions else f"{withdrawal.subject}_001"
    return StudyError(
        "Not everything could be erased",
        f"Of {withdrawal.subject}: {problem.strerror or problem}{file_text}.",
        f"Correct this and continue with: {format_withdraw_command(SessionFolder(data / session_name))}",
        saved="What remains is no longer used as data once erasing has begun.",
    )
