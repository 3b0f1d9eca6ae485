"""Access rights: participants' data are readable only by the account that recorded them.

Folders of a study have mode 700 and their files 600, unless a data folder is exempt (`explain_kept_rights`). A new
file elsewhere gets the usual rights (666 minus umask) where its folder is open to others, otherwise 600.
"""

import contextlib
import errno
import os
import shlex
import stat
from pathlib import Path

from study.store.disk.real_folder import OpenedFolder, is_real_folder, open_folder

PRIVATE_FOLDER, PRIVATE_FILE = 0o700, 0o600
"""Modes of folders and files with participants' data."""
GROUP_AND_OTHERS = 0o077
"""All permission bits of group and others."""


def is_open_to_others(folder: Path) -> bool:
    """Whether group or others have any right to the folder. Never raises; False on systems without such rights."""
    try:
        return os.name == "posix" and bool(folder.stat().st_mode & GROUP_AND_OTHERS)
    except OSError:
        return False


def choose_file_mode(folder: Path) -> int:
    """Choose the mode of a new file in `folder`, before the umask: 600 where the folder is private, otherwise 666."""
    return 0o666 if is_open_to_others(folder) else PRIVATE_FILE


def write_private(path: Path, content: bytes) -> None:
    """Write a file with mode 600, or replace the content of an existing file; not atomic and not synced. A symbolic
    link in its place is refused on systems with O_NOFOLLOW. Raises OSError."""
    flags = os.O_WRONLY | os.O_CREAT | os.O_TRUNC | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_BINARY", 0)
    with os.fdopen(os.open(path, flags, PRIVATE_FILE), "wb") as file:
        file.write(content)


def make_folder(folder: Path, *, private: bool = False) -> None:
    """Create the folder and its missing parents; existing ones are unchanged. private: with mode 700; otherwise, new
    folders are private where their parent is. Raises OSError, FileExistsError where a file has this name."""
    if folder.is_dir():
        return
    parent = folder.absolute().parent
    make_folder(parent, private=private)
    with contextlib.suppress(FileExistsError):
        folder.mkdir(mode=PRIVATE_FOLDER if private or not is_open_to_others(parent) else 0o777)
    if not folder.is_dir():
        raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST), str(folder))


def restrict_to_owner(folder: Path, *, recursive: bool = False) -> None:
    """Remove the rights of group and others from a folder; recursive: also from all its contents. Links are not
    followed, and what cannot be changed is left as it is. Never raises OSError."""
    with contextlib.suppress(OSError), open_folder(folder.absolute()) as opened_folder:
        _restrict_folder(opened_folder, recursive)


def restrict_data_folder(data_folder: Path) -> None:
    """Remove the rights of group and others from the data folder and its folders, unless `explain_kept_rights` gives a
    reason against it. Raises OSError where the folder cannot be listed."""
    if not is_open_to_others(data_folder) or explain_kept_rights(data_folder):
        return
    restrict_to_owner(data_folder.resolve())
    for folder in (path for path in data_folder.iterdir() if is_real_folder(path) and is_open_to_others(path)):
        restrict_to_owner(folder)


def explain_kept_rights(data_folder: Path) -> str:
    """Explain in words why the rights of others to a data folder are not removed: it belongs to another account, is
    meant to be shared (sticky or set-group bit), or holds the working or home folder. Empty where none of these holds,
    or others have no rights."""
    if not is_open_to_others(data_folder):
        return ""
    folder_stat, resolved_data = data_folder.stat(), data_folder.resolve()
    if folder_stat.st_uid != os.geteuid():
        return "it belongs to another account"
    if folder_stat.st_mode & (stat.S_ISVTX | stat.S_ISGID):
        return "it was made to be shared"
    if any(protected_folder.is_relative_to(resolved_data) for protected_folder in (Path.cwd(), Path.home().resolve())):
        return "it holds more than the study"
    return ""


def format_privacy_warning(folder: Path, reason: str = "") -> str:
    """Format a warning if others have rights to the folder; otherwise empty. reason: why a session does not remove
    them."""
    if not is_open_to_others(folder):
        return ""
    mode = stat.S_IMODE(folder.stat().st_mode)
    text = f"Other accounts of this computer have rights to {folder} (mode {mode:03o})."
    command = shlex.join(("chmod", "700", str(folder)))
    return f"{text}{reason and f' A session leaves them: {reason}.'} Remove these rights: {command}"


def format_data_folder_warning(data_folder: Path) -> str:
    """Format a warning if others have rights to a data folder that a session will not remove; otherwise empty."""
    reason = explain_kept_rights(data_folder)
    return format_privacy_warning(data_folder, reason) if reason else ""


def _restrict_folder(opened_folder: OpenedFolder, recursive: bool) -> None:
    """Remove the rights of group and others from an opened folder; recursive: also from its contents, except links.
    Nothing is done without a descriptor. Entries are opened without blocking, because one may be a pipe."""
    if opened_folder.descriptor is None:
        return
    _restrict_access(opened_folder.descriptor)
    for name in opened_folder.list_names() if recursive else ():
        with contextlib.suppress(OSError):
            descriptor = os.open(name, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK, dir_fd=opened_folder.descriptor)
            try:
                _restrict_access(descriptor)
                if stat.S_ISDIR(os.fstat(descriptor).st_mode):
                    _restrict_folder(OpenedFolder(opened_folder.path / name, descriptor), recursive)
            finally:
                os.close(descriptor)


def _restrict_access(descriptor: int) -> None:
    """Remove the rights of group and others from an open folder or regular file. Raises OSError."""
    entry_stat = os.fstat(descriptor)
    if entry_stat.st_mode & GROUP_AND_OTHERS and (stat.S_ISDIR(entry_stat.st_mode) or stat.S_ISREG(entry_stat.st_mode)):
        os.fchmod(descriptor, stat.S_IMODE(entry_stat.st_mode) & ~GROUP_AND_OTHERS)
