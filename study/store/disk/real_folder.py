"""Access to a folder by its open descriptor, so that its contents can be erased without following links.

Entries are addressed relative to the descriptor; a symbolic link that another program puts in place of a folder in the
meantime cannot redirect the erasure. On systems without such calls (Windows) paths are used, and links are only
checked beforehand.
"""

import os
import shutil
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path


def is_real_folder(path: Path) -> bool:
    """Whether the path is a folder and not a link to one."""
    return _read_file_type(path) == stat.S_IFDIR


def is_real_file(path: Path) -> bool:
    """Whether the path is a regular file: no link, pipe or device."""
    return _read_file_type(path) == stat.S_IFREG


@dataclass(frozen=True, slots=True)
class OpenedFolder:
    """An open folder."""

    path: Path
    descriptor: int | None
    """File descriptor of the folder; None on systems without paths relative to a descriptor (Windows)."""

    def list_names(self) -> list[str]:
        """List the names of the entries, sorted. Raises OSError."""
        return sorted(os.listdir(self.path if self.descriptor is None else self.descriptor))  # noqa: PTH208

    def erase(self, name: str) -> None:
        """Erase an entry: a file, a link (not its target), or a folder with its contents. Raises OSError, but not if it
        does not exist."""
        with suppress(FileNotFoundError):
            if stat.S_ISDIR(
                os.stat(self._format_entry_path(name), dir_fd=self.descriptor, follow_symlinks=False).st_mode
            ):
                shutil.rmtree(self._format_entry_path(name), dir_fd=self.descriptor)
            else:
                os.unlink(self._format_entry_path(name), dir_fd=self.descriptor)

    def erase_if_empty(self, name: str) -> None:
        """Erase a folder inside this folder if it is empty; nothing happens if it holds entries, does not exist or is
        no folder. Raises OSError."""
        with suppress(FileNotFoundError, NotADirectoryError):
            with open_folder(self, name) as subfolder:
                is_empty = not subfolder.list_names()
            if is_empty:
                os.rmdir(self._format_entry_path(name), dir_fd=self.descriptor)

    def sync(self) -> None:
        """Sync the directory entries to the disk, where there is a descriptor. Raises OSError."""
        if self.descriptor is not None:
            os.fsync(self.descriptor)

    def _format_entry_path(self, name: str) -> str:
        """Format the path of an entry for system calls: relative to the descriptor, or complete without one."""
        return name if self.descriptor is not None else str(self.path / name)


@contextmanager
def open_folder(start_folder: Path | OpenedFolder, *names: str) -> Iterator[OpenedFolder]:
    """Open the folder `start_folder`, or the one reached from it by `names`, level by level, for the context. Raises
    OSError: NotADirectoryError where a level is a link or no folder, FileNotFoundError where it is missing."""
    folder = _open_without_links(start_folder, None) if isinstance(start_folder, Path) else start_folder
    opened_folders = [] if folder is start_folder else [folder]
    try:
        for name in names:
            folder = _open_without_links(folder.path / name, folder.descriptor)
            opened_folders.append(folder)
        yield folder
    finally:
        for opened_folder in opened_folders:
            if opened_folder.descriptor is not None:
                os.close(opened_folder.descriptor)


def _open_without_links(path: Path, parent_descriptor: int | None) -> OpenedFolder:
    """Open a folder that is no link. parent_descriptor: of the folder that contains it; None: by its path. Raises as
    `open_folder`."""
    if os.open not in os.supports_dir_fd:
        if not is_real_folder(path):
            raise NotADirectoryError(f"{path.name} is a link or no folder")
        return OpenedFolder(path, None)
    flags = os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW
    return OpenedFolder(
        path, os.open(path if parent_descriptor is None else path.name, flags, dir_fd=parent_descriptor)
    )


def _read_file_type(path: Path) -> int:
    """Read the type bits of the entry itself (links are not followed); 0 where it does not exist or cannot be read."""
    try:
        return stat.S_IFMT(path.lstat().st_mode)
    except (OSError, ValueError):  # ValueError: a name that no file can have
        return 0
