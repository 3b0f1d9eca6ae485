"""Provenance of a result: versions, protocol, seeds, input files. Without machine paths and dates, so that the same
work gives the same file."""

import hashlib
import platform
import sys
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path, PurePath
from typing import Any

from study.regular_file import open_regular
from study.store.disk.file_errors import CannotReadError

PACKAGES = ("hapteq", "numpy", "scipy", "numba", "h5py", "pandas", "statsmodels")
"""Packages whose versions a result states, beside that of Python."""


@dataclass(frozen=True, slots=True)
class Parent:
    """An input file of a result."""

    file: str
    sha256: str


@dataclass(frozen=True, slots=True)
class Provenance:
    """Origin of a result, as it is written into the result's file."""

    versions: Mapping[str, str]
    command: tuple[str, ...]
    """As typed, with paths reduced to file names."""
    protocol_hash: str | None = None
    seeds: Mapping[str, int] | None = None
    settings: Mapping[str, float | None] | None = None
    """Effective options on which the result depends."""
    parents: tuple[Parent, ...] = ()

    def as_dict(self) -> dict[str, Any]:
        """Plain values for JSON, TOML and HDF5; unknown ones are left out."""
        plain = asdict(self)
        plain["command"] = list(self.command)
        plain["parents"] = list(plain["parents"])
        return {key: value for key, value in plain.items() if value is not None}


def gather_provenance(
    *,
    protocol_hash: str | None = None,
    seeds: Mapping[str, int] | None = None,
    settings: Mapping[str, float | None] | None = None,
    parents: Sequence[Path] = (),
) -> Provenance:
    """Provenance of the running program. Raises CannotReadError for a missing parent."""
    return Provenance(
        versions=versions(),
        command=command_line(sys.argv),
        protocol_hash=protocol_hash,
        seeds=seeds,
        settings=settings,
        parents=tuple(Parent(as_text(path.name), sha256_of(path)) for path in parents),
    )


def versions() -> dict[str, str]:
    """Versions of Python and of all packages that compute."""
    return {"python": platform.python_version(), **{name: _version(name) for name in PACKAGES}}


def command_line(arguments: Sequence[str]) -> tuple[str, ...]:
    """Arguments with file names only: paths reveal a machine and its owner."""
    return tuple(_without_folders(argument) for argument in arguments)


def as_text(name: str) -> str:
    """A file name as valid text: bytes that are not UTF-8 (surrogates in Python) are replaced."""
    return name.encode(errors="replace").decode()


def sha256_of(path: Path) -> str:
    """SHA-256 of a regular file's content, in hexadecimal. Raises CannotReadError."""
    try:
        with open_regular(path) as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as problem:
        raise CannotReadError(path, problem) from problem


@cache
def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "not installed"


def _without_folders(argument: str) -> str:
    option, equals, value = argument.partition("=") if argument.startswith("--") else ("", "", argument)
    name = PurePath(value).name if "/" in value or "\\" in value else value
    return as_text(option + equals + name)
