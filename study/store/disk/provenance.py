"""Provenance of a result: versions, command, protocol, seeds, settings, and input files with their checksums.

It contains neither folders of the computer nor the time of the work, so that repeated work gives the same file.
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
from study.store.disk.text_file import replace_invalid_bytes

PACKAGES = ("hapteq", "numpy", "scipy", "numba", "h5py", "pandas", "statsmodels")
"""Packages whose versions a result states, in addition to that of Python."""


@dataclass(frozen=True, slots=True)
class InputFile:
    """An input file of a result."""

    file: str
    """Name without folders."""
    sha256: str
    """SHA-256 of the content, in hexadecimal."""


@dataclass(frozen=True, slots=True)
class Provenance:
    """Origin of a result."""

    versions: Mapping[str, str]
    """As in `list_versions`."""
    command: tuple[str, ...]
    """Command line, with paths reduced to file names."""
    protocol_hash: str | None = None
    """Hash of the protocol; None where none was used."""
    seeds: Mapping[str, int] | None = None
    """By their use."""
    settings: Mapping[str, float | None] | None = None
    """Values of the options on which the result depends, in the unit that the name of the option states."""
    parents: tuple[InputFile, ...] = ()

    def as_dict(self) -> dict[str, Any]:
        """Convert to JSON values; fields that are None are left out."""
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
        parents=tuple(InputFile(replace_invalid_bytes(path.name), compute_sha256(path)) for path in parents),
    )


def list_versions() -> dict[str, str]:
    """List the versions of Python and of `PACKAGES`, by name; "not installed" where a package is missing."""
    return {"python": platform.python_version(), **{name: _find_version(name) for name in PACKAGES}}


def anonymise_arguments(arguments: Sequence[str]) -> tuple[str, ...]:
    """Reduce paths in arguments to file names, because paths may identify the computer and its owner."""
    return tuple(_remove_folders(argument) for argument in arguments)


def compute_sha256(path: Path) -> str:
    """Compute the SHA-256 of a regular file's content, in hexadecimal. Raises CannotReadError where the file cannot be
    read."""
    try:
        with open_regular(path) as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as problem:
        raise CannotReadError(path, problem) from problem


@cache
def _find_version(package: str) -> str:
    """Find the version of a package; "not installed" without it."""
    try:
        return version(package)
    except PackageNotFoundError:
        return "not installed"


def _remove_folders(argument: str) -> str:
    """Reduce a path in an argument, also one after `--option=`, to its last part; replace invalid bytes."""
    option, equals, value = argument.partition("=") if argument.startswith("--") else ("", "", argument)
    value_name = PurePath(value).name if "/" in value or "\\" in value else value
    return replace_invalid_bytes(option + equals + value_name)
