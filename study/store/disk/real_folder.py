"""A folder that is held open by its descriptor, so that its contents can be erased without following links.

Entries are addressed relative to the descriptor; a symbolic link that another program puts in place of a folder in the
meantime cannot redirect the erasure. On systems without such calls (Windows) paths are used, and links are only
checked.
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
    return _read_kind(path) == stat.S_IFDIR


def is_real_file(path: Path) -> bool:
    """Whether the path is a regular file: no link, pipe or device."""
    return _read_kind(path) == stat.S_IFREG


@dataclass(frozen=True, slots=True)
class RealFolder:
    """A folder that is held open; its entries are addressed by its descriptor, where the system can."""

    path: Path
    descriptor: int | None
    """None on systems without paths relative to a descriptor (Windows)."""

    def names(self) -> list[str]:
        """Names of the entries, sorted. Raises OSError."""
        return sorted(os.listdir(self.path if self.descriptor is None else self.descriptor))  # noqa: PTH208

    def erase(self, name: str) -> None:
        """Erase an entry: a file, a link (not its target), or a folder with its contents. No error if it does not
        exist; raises OSError otherwise."""
        with suppress(FileNotFoundError):
            if stat.S_ISDIR(os.stat(self._path_text(name), dir_fd=self.descriptor, follow_symlinks=False).st_mode):
                shutil.rmtree(self._path_text(name), dir_fd=self.descriptor)
            else:
                os.unlink(self._path_text(name), dir_fd=self.descriptor)

    def erase_if_empty(self, name: str) -> None:
        """Erase a folder inside this folder if it is empty; nothing happens if it does not exist or is no folder.
        Raises OSError."""
        with suppress(FileNotFoundError, NotADirectoryError):
            with open_folder(self, name) as subfolder:
                empty = not subfolder.names()
            if empty:
                os.rmdir(self._path_text(name), dir_fd=self.descriptor)

    def sync(self) -> None:
        """Sync the directory entries to the disk, where there is a descriptor. Raises OSError."""
        if self.descriptor is not None:
            os.fsync(self.descriptor)

    def _path_text(self, name: str) -> str:
        return name if self.descriptor is not None else str(self.path / name)


@contextmanager
def open_folder(start: Path | RealFolder, *names: str) -> Iterator[RealFolder]:
    """The folder `start`, or the one reached from it by `names`, level by level.

    Folders opened here are closed at the end. Raises OSError: NotADirectoryError where a level is a link or no folder,
    FileNotFoundError where it is missing.
    """
    folder = _open_real(start, None) if isinstance(start, Path) else start
    opened_folders = [] if folder is start else [folder]
    try:
        for name in names:
            folder = _open_real(folder.path / name, folder.descriptor)
            opened_folders.append(folder)
        yield folder
    finally:
        for opened_folder in opened_folders:
            if opened_folder.descriptor is not None:
                os.close(opened_folder.descriptor)


def _open_real(path: Path, parent: int | None) -> RealFolder:
    """Open a folder that is no link. parent: descriptor of the folder that contains it; None: by its path."""
    if os.open not in os.supports_dir_fd:
        if not is_real_folder(path):
            raise NotADirectoryError(f"{path.name} is a link or no folder")
        return RealFolder(path, None)
    flags = os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW
    return RealFolder(path, os.open(path if parent is None else path.name, flags, dir_fd=parent))


def _read_kind(path: Path) -> int:
    """Type bits of the entry itself (links are not followed); 0 where it does not exist."""
    try:
        return stat.S_IFMT(path.lstat().st_mode)
    except (OSError, ValueError):  # ValueError: a name that no file can have
        return 0
