"""Provenance of a result: versions, command, protocol, seeds, settings, and input files with their checksums.

It contains no paths of the computer and no dates, so that the same work gives the same file. Gathered by every command
that writes a result.
"""

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
"""Packages whose versions a result states, in addition to that of Python."""


@dataclass(frozen=True, slots=True)
class Parent:
    """An input file of a result."""

    file: str
    """Name without folders."""
    sha256: str
    """SHA-256 of the content, in hexadecimal."""


@dataclass(frozen=True, slots=True)
class Provenance:
    """Origin of a result, as it is written into the result's file."""

    versions: Mapping[str, str]
    """Version of Python and of each of `PACKAGES`."""
    command: tuple[str, ...]
    """Command line, with paths reduced to file names."""
    protocol_hash: str | None = None
    """Hash of the protocol; None where none was used."""
    seeds: Mapping[str, int] | None = None
    """Seeds of random numbers, by what they were used for."""
    settings: Mapping[str, float | None] | None = None
    """Values in effect of the options on which the result depends."""
    parents: tuple[Parent, ...] = ()
    """Input files of the result."""

    def as_dict(self) -> dict[str, Any]:
        """Plain values for JSON, TOML and HDF5; fields that are None are left out."""
        values = asdict(self)
        values["command"] = list(self.command)
        values["parents"] = list(values["parents"])
        return {key: value for key, value in values.items() if value is not None}


def gather_provenance(
    *,
    protocol_hash: str | None = None,
    seeds: Mapping[str, int] | None = None,
    settings: Mapping[str, float | None] | None = None,
    parents: Sequence[Path] = (),
) -> Provenance:
    """Gather the provenance of a result of the running program. parents: paths of the input files; other arguments as
    in `Provenance`. Raises CannotReadError where an input file cannot be read."""
    return Provenance(
        versions=list_versions(),
        command=anonymise_arguments(sys.argv),
        protocol_hash=protocol_hash,
        seeds=seeds,
        settings=settings,
        parents=tuple(Parent(replace_invalid_bytes(path.name), compute_sha256(path)) for path in parents),
    )


def list_versions() -> dict[str, str]:
    """Versions of Python and of `PACKAGES`; "not installed" where a package is missing."""
    return {"python": platform.python_version(), **{name: _find_version(name) for name in PACKAGES}}


def anonymise_arguments(arguments: Sequence[str]) -> tuple[str, ...]:
    """Reduce paths in arguments to file names, because paths may identify the computer and its owner."""
    return tuple(_remove_folders(argument) for argument in arguments)


def replace_invalid_bytes(name: str) -> str:
    """Make a file name valid text: bytes that are not UTF-8 (surrogates in Python) are replaced."""
    return name.encode(errors="replace").decode()


def compute_sha256(path: Path) -> str:
    """Compute the SHA-256 of a regular file's content, in hexadecimal. Raises CannotReadError."""
    try:
        with open_regular(path) as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as problem:
        raise CannotReadError(path, problem) from problem


@cache
def _find_version(package: str) -> str:
    """Version of an installed package; "not installed" without it. Cached, because it does not change."""
    try:
        return version(package)
    except PackageNotFoundError:
        return "not installed"


def _remove_folders(argument: str) -> str:
    """The argument with a path, also one after `--option=`, reduced to its last part."""
    option, equals, value = argument.partition("=") if argument.startswith("--") else ("", "", argument)
    value_name = PurePath(value).name if "/" in value or "\\" in value else value
    return replace_invalid_bytes(option + equals + value_name)
