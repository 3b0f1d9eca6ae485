"""What hapteq needs at run time is under no GPL or AGPL; parts under the LGPL, which may be linked, stand in a list."""

import re
import tomllib
from collections.abc import Iterable
from importlib.metadata import Distribution, distribution
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).parents[2]
UNDER_LGPL: set[str] = set()
"""Runtime dependencies under the LGPL. A new one is entered here by hand, after a look at how it is used."""
TITLE = 120
"""Characters: a longer `License` is the whole text, which may name the licences of libraries in the wheel."""


def wanted(requirements: Iterable[str], extras: Iterable[str] = ("",)) -> list[Requirement]:
    """Those that hold on this machine, with these extras of whom they belong to."""
    parsed = [Requirement(text) for text in requirements]
    return [each for each in parsed if not each.marker or any(each.marker.evaluate({"extra": x}) for x in extras)]


def runtime_distributions(requirements: Iterable[str]) -> dict[str, Distribution]:
    """The installed distributions that the requirements pull in, by canonical name. Each is needed, so that one that is
    not installed raises PackageNotFoundError."""
    found: dict[str, Distribution] = {}
    todo, seen = wanted(requirements), set()
    while todo:
        each = todo.pop()
        key = (canonicalize_name(each.name), *sorted(each.extras))
        if key not in seen:
            seen.add(key)
            found[key[0]] = distribution(each.name)
            todo += wanted(found[key[0]].requires or (), ("", *each.extras))
    return found


def stated(found: Distribution) -> str:
    """The licence by its SPDX expression, else by classifiers and the field `License`; empty where none is said."""
    if expression := found.metadata.get("License-Expression"):
        return expression
    classifiers = [text for text in found.metadata.get_all("Classifier") or () if text.startswith("License ::")]
    field = (found.metadata.get("License") or "").strip()
    title = field if len(field) <= TITLE else field.splitlines()[0]
    return "; ".join(filter(None, [*classifiers, title]))


def family(licence: str) -> str:
    """ "GPL" (with AGPL), "LGPL" or "free". Where "OR" leaves a choice, the freest counts."""
    if " OR " in licence and "(" not in licence:
        kinds = {family(part) for part in licence.split(" OR ")}
        return next(kind for kind in ("free", "LGPL", "GPL") if kind in kinds)
    # The runtime libraries of the GNU compilers, in many wheels, leave free what is linked with them.
    rest = re.sub(r"GPL-[\w.-]+ WITH GCC-exception-[\d.]+", "", licence)
    lesser = r"LGPL|(Lesser|Library) General Public"
    if re.search(r"GPL|General Public", re.sub(lesser, "", rest, flags=re.IGNORECASE), re.IGNORECASE):
        return "GPL"
    return "LGPL" if re.search(lesser, rest, re.IGNORECASE) else "free"


@pytest.fixture(scope="module")
def licences() -> dict[str, str]:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    return {name: stated(found) for name, found in runtime_distributions(project["dependencies"]).items()}


def test_all_that_is_needed_states_a_licence(licences):
    assert {"numpy", "scipy", "textual", "markdown-it-py"} <= set(licences)  # the last is pulled in by others alone
    assert [name for name, licence in licences.items() if not licence] == []


def test_nothing_needed_is_under_the_gpl(licences):
    assert {name: licence for name, licence in licences.items() if family(licence) == "GPL"} == {}


def test_what_is_under_the_lgpl_is_in_the_list(licences):
    assert {name for name, licence in licences.items() if family(licence) == "LGPL"} == UNDER_LGPL


@pytest.mark.parametrize(
    ("licence", "kind"),
    [
        ("GPL-3.0-or-later", "GPL"),
        ("AGPL-3.0-only", "GPL"),
        ("License :: OSI Approved :: GNU General Public License v3 (GPLv3)", "GPL"),
        ("License :: OSI Approved :: GNU Affero General Public License v3", "GPL"),
        ("MIT AND GPL-2.0-only", "GPL"),
        ("License :: OSI Approved :: GNU Lesser General Public License v3 (LGPLv3); LGPL", "LGPL"),
        ("MIT OR GPL-2.0-only", "free"),
        ("BSD-3-Clause AND GPL-3.0-or-later WITH GCC-exception-3.1", "free"),
        ("License :: OSI Approved :: MIT License", "free"),
    ],
)
def test_the_families_of_licences(licence, kind):
    assert family(licence) == kind


def test_a_dependency_of_a_dependency_is_found(tmp_path, monkeypatch):
    for name, lines in (("outer", "License: MIT\nRequires-Dist: inner[more]\nRequires-Dist: no; extra=='x'\n"),
                        ("inner", "License-Expression: MIT\nRequires-Dist: planted; extra == 'more'\n"),
                        ("planted", f"License: GNU GENERAL PUBLIC LICENSE\n        {'text ' * 30}\n")):  # fmt: skip
        folder = tmp_path / f"{name}-1.0.dist-info"
        folder.mkdir()
        (folder / "METADATA").write_text(f"Metadata-Version: 2.4\nName: {name}\nVersion: 1.0\n{lines}", "utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    found = runtime_distributions(["outer", "absent; python_version < '3'"])
    assert {name for name, each in found.items() if family(stated(each)) == "GPL"} == {"planted"}
    assert set(found) == {"outer", "inner", "planted"}
