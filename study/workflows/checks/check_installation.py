"""Check that this computer meets the requirements of a study: Python and packages, terminal, data folder, privacy.

Each check returns a `DeviceFinding`, with advice where something is wrong; a missing part is a finding, not an error.
"""

import importlib.util
import locale
import os
import platform
import shutil
import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, metadata, packages_distributions, requires, version
from pathlib import Path

from packaging.requirements import Requirement
from packaging.specifiers import SpecifierSet

import study
from study.session.views.views import DeviceFinding
from study.store.disk.privacy import privacy_warning

HAPTEQ = "hapteq"
"""Name of the installed distribution."""
IMPORT_NAMES = ("study", "analysis", "equalizer", "protocols")
"""Top-level packages of hapteq, whose generic names another distribution or file could shadow."""

SMALLEST = (80, 24)
"""Columns and rows of a terminal in which every screen fits."""

ROOM_BYTES = 10**9
"""Free disk space (bytes) that is enough for about ten sessions with all recordings."""


@dataclass(frozen=True, slots=True)
class Terminal:
    """Properties of a terminal that are checked: character encoding, type, and size in characters."""

    encoding: str
    kind: str
    """Value of the environment variable TERM."""
    columns: int
    rows: int


def check_installation(data: Path, terminal: Terminal | None) -> tuple[DeviceFinding, ...]:
    """All findings. data: folder of the sessions. terminal: from `this_terminal()`. Writes a temporary empty file into
    `data`, or into its nearest existing parent."""
    owners, home = packages_distributions(), Path(study.__file__).parents[1]
    return (
        *check_packages(),
        *(check_name(name, owners, home) for name in IMPORT_NAMES),
        *check_terminal(terminal),
        check_folder(data),
        check_privacy(data),
    )


def check_packages() -> tuple[DeviceFinding, ...]:
    """Versions of Python and of the installed packages, against the requirements of the installed hapteq."""
    try:
        python_requirement, package_requirements = metadata(HAPTEQ)["Requires-Python"], requires(HAPTEQ) or []
    except PackageNotFoundError:
        advice = "Run `make study` in its folder once: that installs hapteq and what it needs."
        return (DeviceFinding(HAPTEQ, "not installed, so what it needs is not known", fine=False, advice=advice),)
    return (
        DeviceFinding(HAPTEQ, version(HAPTEQ), fine=True),
        check_version("Python", platform.python_version(), SpecifierSet(python_requirement)),
        *(
            check_requirement(requirement)
            for requirement in map(Requirement, package_requirements)
            if _always(requirement)
        ),
    )


def check_requirement(requirement: Requirement) -> DeviceFinding:
    """Whether the installed package, if there is one, satisfies a requirement."""
    try:
        return check_version(requirement.name, version(requirement.name), requirement.specifier)
    except PackageNotFoundError:
        return DeviceFinding(requirement.name, "not installed", fine=False, advice=_INSTALL)


def check_version(name: str, installed: str, required: SpecifierSet) -> DeviceFinding:
    """Whether a version satisfies a specifier; prereleases count."""
    fine = required.contains(installed, prereleases=True)
    needs = f" (needs {required})" if str(required) else ""
    return DeviceFinding(name, f"{installed}{needs}", fine, "" if fine else _INSTALL)


def check_name(name: str, owners: Mapping[str, Sequence[str]], home: Path) -> DeviceFinding:
    """Whether `import name` gives hapteq's own package. owners: distributions by the top-level names that they install.
    home: folder that contains hapteq's packages."""
    other_distributions = sorted(set(owners.get(name, ())) - {HAPTEQ})
    if other_distributions:
        advice = (
            "Install hapteq into an environment of its own: "
            f"{', '.join(other_distributions)} must not share one with it."
        )
        return DeviceFinding(
            f"import {name}", f"belongs to {' and '.join(other_distributions)} as well", fine=False, advice=advice
        )
    spec = importlib.util.find_spec(name)
    if spec is None or spec.origin is None or Path(spec.origin) != home / name / "__init__.py":
        origin = "nowhere to be found" if spec is None or spec.origin is None else f"taken from {spec.origin}"
        advice = "Rename that file, or start hapteq without its folder on PYTHONPATH."
        return DeviceFinding(f"import {name}", origin, fine=False, advice=advice)
    return DeviceFinding(f"import {name}", "hapteq's own", fine=True)


def this_terminal() -> Terminal | None:
    """The terminal of stdout, else that of stderr; None if neither is a terminal."""
    for stream in (sys.stdout, sys.stderr):
        if stream is not None and stream.isatty():
            size = os.get_terminal_size(stream.fileno())
            encoding = stream.encoding or locale.getpreferredencoding(False)
            return Terminal(encoding, os.environ.get("TERM", ""), size.columns, size.lines)
    return None


def check_terminal(terminal: Terminal | None) -> tuple[DeviceFinding, ...]:
    """Encoding, size and colours of the terminal. No terminal is fine: the check may run in a script."""
    if terminal is None:
        return (DeviceFinding("Terminal", "none here, so it was not checked", fine=True),)
    unicode = terminal.encoding.lower().replace("-", "") == "utf8"
    size = (terminal.columns, terminal.rows)
    large = all(actual >= minimum for actual, minimum in zip(size, SMALLEST, strict=True))
    able = terminal.kind not in ("", "dumb")
    smallest = f"{SMALLEST[0]} x {SMALLEST[1]}"
    return (
        DeviceFinding("Characters", terminal.encoding, unicode, "" if unicode else f"Set LANG=C.UTF-8, {_OR_PLAIN}"),
        DeviceFinding(
            "Terminal size",
            f"{size[0]} x {size[1]} (needs {smallest})",
            large,
            "" if large else f"Make the window larger, {_OR_PLAIN}",
        ),
        DeviceFinding("Colours", _colours(terminal.kind), able, "" if able else f"Take another terminal, {_OR_PLAIN}"),
    )


def check_folder(data: Path) -> DeviceFinding:
    """Whether sessions can be written below `data`, and whether `ROOM_BYTES` are free. A missing folder is fine: the
    first session creates it."""
    name = "Data folder"
    folder = next(place for place in (data.absolute(), *data.absolute().parents) if place.exists())
    try:
        with tempfile.TemporaryFile(dir=folder):
            free_bytes = shutil.disk_usage(folder).free
    except OSError as problem:
        advice = "Choose another folder with --data, or change the rights of this one."
        return DeviceFinding(name, f"{data}: {problem.strerror}", fine=False, advice=advice)
    fine = free_bytes >= ROOM_BYTES
    value = f"{data}: can be written, {free_bytes / 1e9:.1f} GB free"
    return DeviceFinding(name, value, fine, "" if fine else "Make room, or choose another folder with --data.")


def check_privacy(data: Path) -> DeviceFinding:
    """Whether other accounts of this computer can read the data folder."""
    name = "Data rights"
    if not data.exists():
        return DeviceFinding(name, f"{data}: not there yet; it will be for this account alone", fine=True)
    warning = privacy_warning(data)
    value = f"{data}: open to other accounts" if warning else f"{data}: for this account alone"
    return DeviceFinding(name, value, not warning, warning)


def _always(requirement: Requirement) -> bool:
    """Whether a requirement applies on this computer, without any optional extra."""
    return requirement.marker is None or requirement.marker.evaluate({"extra": ""})


def _colours(kind: str) -> str:
    """Number of colours of a terminal in words, by the environment. kind: value of TERM."""
    if os.environ.get("NO_COLOR"):
        return "switched off by NO_COLOR; no information is given by colour alone"
    if os.environ.get("COLORTERM") in ("truecolor", "24bit"):
        return "16 million"
    return "256" if "256color" in kind else f"few (TERM={kind or 'not set'})"


_OR_PLAIN = "or use `hapteq study --plain`."
_INSTALL = "Run `make study` in hapteq's folder, or install hapteq again."
