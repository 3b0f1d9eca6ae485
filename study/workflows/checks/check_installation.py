"""Check that this computer meets the requirements of a study: Python and packages, terminal, data folder, privacy.

Each check returns one or more `DeviceFinding`, with advice where something is wrong; a missing part is a finding, not
an error. `check_installation` runs all of them.
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
from study.session.views.participant_views import DeviceFinding
from study.store.disk.privacy import format_privacy_warning

DISTRIBUTION_NAME = "hapteq"
"""Name of the installed distribution."""
IMPORT_NAMES = ("study", "analysis", "equalizer", "protocols")
"""Top-level packages of hapteq, whose generic names another distribution or file could shadow."""

MIN_TERMINAL_SIZE = (80, 24)
"""Columns and rows of a terminal for which the screens are made."""

MIN_FREE_BYTES = 10**9
"""Free disk space (bytes) below which it is reported: 1 GB, chosen as enough for about ten sessions with all
recordings."""


@dataclass(frozen=True, slots=True)
class Terminal:
    """Properties of a terminal that are checked: character encoding, type, and size in characters."""

    encoding: str
    kind: str
    """Value of the environment variable TERM."""
    columns: int
    rows: int


def check_installation(data: Path, terminal: Terminal | None) -> tuple[DeviceFinding, ...]:
    """Run all checks. data: folder of the sessions. terminal: from `detect_terminal()`. Writes a temporary empty file
    into `data`, or into its nearest existing parent."""
    distributions_by_package, package_folder = packages_distributions(), Path(study.__file__).parents[1]
    return (
        *check_packages(),
        *(check_import_name(name, distributions_by_package, package_folder) for name in IMPORT_NAMES),
        *check_terminal(terminal),
        check_data_folder(data),
        check_privacy(data),
    )


def check_packages() -> tuple[DeviceFinding, ...]:
    """Check the versions of Python and of the installed packages, against the requirements of the installed hapteq."""
    try:
        python_requirement, package_requirements = (
            metadata(DISTRIBUTION_NAME)["Requires-Python"],
            requires(DISTRIBUTION_NAME) or [],
        )
    except PackageNotFoundError:
        advice = "Run `make study` in its folder once: that installs hapteq and what it needs."
        return (
            DeviceFinding(DISTRIBUTION_NAME, "not installed, so what it needs is not known", fine=False, advice=advice),
        )
    return (
        DeviceFinding(DISTRIBUTION_NAME, version(DISTRIBUTION_NAME), fine=True),
        check_version("Python", platform.python_version(), SpecifierSet(python_requirement)),
        *(
            check_requirement(requirement)
            for requirement in map(Requirement, package_requirements)
            if requirement.marker is None or requirement.marker.evaluate({"extra": ""})
        ),
    )


def check_requirement(requirement: Requirement) -> DeviceFinding:
    """Check whether the installed package satisfies a requirement; a package that is not installed does not."""
    try:
        return check_version(requirement.name, version(requirement.name), requirement.specifier)
    except PackageNotFoundError:
        return DeviceFinding(requirement.name, "not installed", fine=False, advice=_INSTALL_ADVICE)


def check_version(name: str, installed_version: str, required_versions: SpecifierSet) -> DeviceFinding:
    """Check whether a version satisfies a specifier; prereleases count."""
    is_satisfied = required_versions.contains(installed_version, prereleases=True)
    requirement_text = f" (needs {required_versions})" if str(required_versions) else ""
    return DeviceFinding(
        name, f"{installed_version}{requirement_text}", is_satisfied, "" if is_satisfied else _INSTALL_ADVICE
    )


def check_import_name(
    package_name: str, distributions_by_package: Mapping[str, Sequence[str]], package_folder: Path
) -> DeviceFinding:
    """Check whether `import package_name` gives hapteq's own package. distributions_by_package: distributions by the
    top-level names that they install. package_folder: folder that contains hapteq's packages."""
    other_distributions = sorted(set(distributions_by_package.get(package_name, ())) - {DISTRIBUTION_NAME})
    if other_distributions:
        advice = (
            "Install hapteq into an environment of its own: "
            f"{', '.join(other_distributions)} must not share one with it."
        )
        return DeviceFinding(
            f"import {package_name}",
            f"belongs to {' and '.join(other_distributions)} as well",
            fine=False,
            advice=advice,
        )
    module_spec = importlib.util.find_spec(package_name)
    if (
        module_spec is None
        or module_spec.origin is None
        or Path(module_spec.origin) != package_folder / package_name / "__init__.py"
    ):
        origin_text = (
            "nowhere to be found"
            if module_spec is None or module_spec.origin is None
            else f"taken from {module_spec.origin}"
        )
        advice = "Rename that file, or start hapteq without its folder on PYTHONPATH."
        return DeviceFinding(f"import {package_name}", origin_text, fine=False, advice=advice)
    return DeviceFinding(f"import {package_name}", "hapteq's own", fine=True)


def detect_terminal() -> Terminal | None:
    """Read the properties of the terminal of stdout, else that of stderr; None if neither is a terminal."""
    for stream in (sys.stdout, sys.stderr):
        if stream is not None and stream.isatty():
            size = os.get_terminal_size(stream.fileno())
            encoding = stream.encoding or locale.getpreferredencoding(False)
            return Terminal(encoding, os.environ.get("TERM", ""), size.columns, size.lines)
    return None


def check_terminal(terminal: Terminal | None) -> tuple[DeviceFinding, ...]:
    """Check encoding, size and colours of the terminal: fine are UTF-8, at least `MIN_TERMINAL_SIZE`, and a TERM other
    than "dumb" or empty. No terminal (None) is fine: the check may run in a script."""
    if terminal is None:
        return (DeviceFinding("Terminal", "none here, so it was not checked", fine=True),)
    is_utf8 = terminal.encoding.lower().replace("-", "") == "utf8"
    terminal_size = (terminal.columns, terminal.rows)
    is_large_enough = all(actual >= minimum for actual, minimum in zip(terminal_size, MIN_TERMINAL_SIZE, strict=True))
    has_colours = terminal.kind not in ("", "dumb")
    minimum_text = f"{MIN_TERMINAL_SIZE[0]} x {MIN_TERMINAL_SIZE[1]}"
    return (
        DeviceFinding(
            "Characters", terminal.encoding, is_utf8, "" if is_utf8 else f"Set LANG=C.UTF-8, {_PLAIN_ADVICE}"
        ),
        DeviceFinding(
            "Terminal size",
            f"{terminal_size[0]} x {terminal_size[1]} (needs {minimum_text})",
            is_large_enough,
            "" if is_large_enough else f"Make the window larger, {_PLAIN_ADVICE}",
        ),
        DeviceFinding(
            "Colours",
            _describe_colours(terminal.kind),
            has_colours,
            "" if has_colours else f"Take another terminal, {_PLAIN_ADVICE}",
        ),
    )


def check_data_folder(data: Path) -> DeviceFinding:
    """Check whether sessions can be written below `data`, by a temporary file, and whether `MIN_FREE_BYTES` are free. A
    missing folder is fine: the first session creates it."""
    finding_name = "Data folder"
    try:
        nearest_folder = next(folder for folder in (data.absolute(), *data.absolute().parents) if folder.exists())
        with tempfile.TemporaryFile(dir=nearest_folder):
            free_bytes = shutil.disk_usage(nearest_folder).free
    except OSError as error:
        return DeviceFinding(finding_name, f"{data}: {error.strerror}", fine=False, advice=_RIGHTS_ADVICE)
    has_enough_space = free_bytes >= MIN_FREE_BYTES
    value_text = f"{data}: can be written, {free_bytes / 1e9:.1f} GB free"
    return DeviceFinding(
        finding_name,
        value_text,
        has_enough_space,
        "" if has_enough_space else "Make room, or choose another folder with --data.",
    )


def check_privacy(data: Path) -> DeviceFinding:
    """Check whether other accounts of this computer can read the data folder. A missing folder is fine."""
    finding_name = "Data rights"
    try:
        data.stat()
    except (FileNotFoundError, NotADirectoryError):
        return DeviceFinding(finding_name, f"{data}: not there yet; it will be for this account alone", fine=True)
    except OSError as error:
        return DeviceFinding(finding_name, f"{data}: {error.strerror}", fine=False, advice=_RIGHTS_ADVICE)
    warning = format_privacy_warning(data)
    value_text = f"{data}: open to other accounts" if warning else f"{data}: for this account alone"
    return DeviceFinding(finding_name, value_text, not warning, warning)


def _describe_colours(kind: str) -> str:
    """Describe the number of colours of a terminal, from the environment variables NO_COLOR and COLORTERM. kind: value
    of TERM."""
    if os.environ.get("NO_COLOR"):
        return "switched off by NO_COLOR; no information is given by colour alone"
    if os.environ.get("COLORTERM") in ("truecolor", "24bit"):
        return "16 million"
    return "256" if "256color" in kind else f"few (TERM={kind or 'not set'})"


_PLAIN_ADVICE = "or use `hapteq study --plain`."
"""End of each advice on the terminal: the line mode needs no particular terminal."""
_RIGHTS_ADVICE = "Choose another folder with --data, or change the rights of this one."
"""Advice for a data folder that this account cannot use."""
_INSTALL_ADVICE = "Run `make study` in hapteq's folder, or install hapteq again."
"""Advice for a missing or unsuitable package or Python."""
