"""Locates the vendor's library on this computer, where its installer and its own tools put it."""

import platform
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

SDK_VARIABLES = ("FDSDK", "FORCEDIM_SDK")
"""Environment variables that name the SDK's folder; the second is the older."""

WINDOWS_FOLDERS = (("LOCALAPPDATA", "Force Dimension"), ("ProgramFiles", "Force Dimension"))
"""Environment variable, and the folder below it that holds sdk-*."""


@dataclass(frozen=True, slots=True)
class Computer:
    """What decides where the vendor's library is searched."""

    system: str
    """As sys.platform: linux, darwin, win32."""
    machine: str
    """As platform.machine()."""
    environ: Mapping[str, str]
    home: Path


def this_computer(environ: Mapping[str, str]) -> Computer:
    """The running computer, with these environment variables."""
    return Computer(sys.platform, platform.machine(), environ, Path.home())


def find_library(computer: Computer) -> Path | None:
    """libdrd before libdhd: it holds all of the other's functions and the automatic calibration besides."""
    return next((path for pattern in library_patterns(computer) if (path := _newest(*pattern)) is not None), None)


def library_patterns(computer: Computer) -> Iterator[tuple[Path, str]]:
    """(folder, file pattern), the most wanted first. A variable that is set is meant: it comes before all else."""
    for folder in _folders(computer):
        for library in ("drd", "dhd"):
            yield folder, _file_pattern(library, computer)


def _folders(computer: Computer) -> Iterator[Path]:
    environ = computer.environ
    roots = [Path(environ[name]) for name in SDK_VARIABLES if environ.get(name)]
    if computer.system == "win32":
        for variable, vendor in WINDOWS_FOLDERS:
            if environ.get(variable):
                roots += sorted((Path(environ[variable]) / vendor).glob("sdk-*"), key=_version_in, reverse=True)
        yield from (root / "bin" for root in roots)
        return
    system, compiler = ("mac", "clang") if computer.system == "darwin" else ("lin", "gcc")
    for root in roots:
        yield root / "lib" / "release" / f"{system}-{computer.machine}-{compiler}"
        yield root / "lib"
    yield computer.home / ".local" / "lib"
    yield Path("/usr/local/lib")


def _file_pattern(library: str, computer: Computer) -> str:
    if computer.system == "win32":
        return f"{library}64.dll"
    return f"lib{library}*.dylib" if computer.system == "darwin" else f"lib{library}.so*"


def _newest(folder: Path, pattern: str) -> Path | None:
    found = [path for path in folder.glob(pattern) if path.is_file()]
    return max(found, key=_version_in, default=None)


def _version_in(path: Path) -> tuple[int, ...]:
    """Numbers in a name: libdrd.so.3.17.5 is newer than libdrd.so.3.9.0, and sdk-3.17.5 than sdk-3.9.0."""
    return tuple(int(part) for part in path.name.replace("-", ".").split(".") if part.isdigit())
