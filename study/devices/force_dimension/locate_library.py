"""Locates the shared library of Force Dimension's SDK (libdrd or libdhd) on this computer.

The folders that environment variables state are searched first, then those in which the vendor's installer and tools
put the library on Windows, macOS and Linux.
"""

import platform
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

SDK_VARIABLES = ("FDSDK", "FORCEDIM_SDK")
"""Environment variables that contain the path of the SDK, in order of preference; the second is the older name."""

WINDOWS_FOLDERS = (("LOCALAPPDATA", "Force Dimension"), ("ProgramFiles", "Force Dimension"))
"""Windows: environment variable with the path of a folder, and its subfolder that contains the folders sdk-VERSION."""


@dataclass(frozen=True, slots=True)
class Computer:
    """Properties of a computer that determine in which folders the vendor's library is searched."""

    system: str
    """As sys.platform: linux, darwin, win32."""
    machine: str
    """As platform.machine()."""
    environ: Mapping[str, str]
    """Environment variables."""
    home: Path
    """The user's home folder."""


def describe_this_computer(environ: Mapping[str, str]) -> Computer:
    """Describe the running computer, with these environment variables."""
    return Computer(sys.platform, platform.machine(), environ, Path.home())


def find_library(computer: Computer) -> Path | None:
    """Find the newest library in the first folder that contains one; None where none is found. In each folder libdrd
    comes before libdhd: it has all functions of libdhd and the automatic calibration."""
    return next(
        (path for pattern in list_library_patterns(computer) if (path := _find_newest(*pattern)) is not None), None
    )


def list_library_patterns(computer: Computer) -> Iterator[tuple[Path, str]]:
    """List pairs (folder, file pattern) in order of preference."""
    for folder in _list_folders(computer):
        for library_name in ("drd", "dhd"):
            yield folder, _make_file_pattern(library_name, computer)


def _list_folders(computer: Computer) -> Iterator[Path]:
    """List the folders to search, in order of preference: those of `SDK_VARIABLES` first, because the user chose them;
    then, on Windows, those of each of `WINDOWS_FOLDERS`, the newest version first."""
    environ = computer.environ
    roots = [Path(environ[name]) for name in SDK_VARIABLES if environ.get(name)]
    if computer.system == "win32":
        for variable, vendor_folder in WINDOWS_FOLDERS:
            if environ.get(variable):
                roots += sorted(
                    (Path(environ[variable]) / vendor_folder).glob("sdk-*"), key=_parse_version, reverse=True
                )
        yield from (root / "bin" for root in roots)
        return
    system, compiler = ("mac", "clang") if computer.system == "darwin" else ("lin", "gcc")
    for root in roots:
        yield root / "lib" / "release" / f"{system}-{computer.machine}-{compiler}"
        yield root / "lib"
    yield computer.home / ".local" / "lib"
    yield Path("/usr/local/lib")


def _make_file_pattern(library_name: str, computer: Computer) -> str:
    """Make the glob pattern of a library's file names. library_name: drd or dhd."""
    if computer.system == "win32":
        return f"{library_name}64.dll"
    return f"lib{library_name}*.dylib" if computer.system == "darwin" else f"lib{library_name}.so*"


def _find_newest(folder: Path, pattern: str) -> Path | None:
    """Find the file with the highest version number that matches the pattern; None where none does."""
    candidates = [path for path in folder.glob(pattern) if path.is_file()]
    return max(candidates, key=_parse_version, default=None)


def _parse_version(path: Path) -> tuple[int, ...]:
    """Parse the version as the numbers in a name, so that libdrd.so.3.17.5 is newer than libdrd.so.3.9.0."""
    return tuple(int(part) for part in path.name.replace("-", ".").split(".") if part.isdigit())
