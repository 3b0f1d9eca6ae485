"""What docs/architecture.md and docs/contributing.md say of the structure is so."""

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PACKAGES = ("protocols", "equalizer", "analysis", "study")
APART = {"study/launcher"}
"""Installed beside the packages: no room of theirs."""


def rooms() -> set[str]:
    modules = [path for package in PACKAGES for path in (ROOT / package).rglob("*.py") if path.name != "__init__.py"]
    return {path.parent.relative_to(ROOT).as_posix() for path in modules} - APART


def test_every_room_is_in_the_architecture_and_every_room_there_exists():
    text = (DOCS / "architecture.md").read_text("utf-8")
    named = re.findall(r"^\| `([a-z0-9_/]+)` \|", text, re.MULTILINE)
    assert len(named) == len(set(named))
    assert set(named) == rooms()


@pytest.mark.parametrize("page", ["architecture.md", "contributing.md"])
def test_every_path_in_a_page_exists(page):
    roots = "|".join((*PACKAGES, "tests", "docs"))
    paths = re.findall(rf"`((?:{roots})/[a-z0-9_/.]*)`", (DOCS / page).read_text("utf-8"))
    assert len(paths) > 10
    assert [path for path in paths if not (ROOT / path).exists()] == []


@pytest.mark.parametrize("page", ["architecture.md", "contributing.md"])
def test_every_function_that_a_page_points_to_is_in_that_file(page):
    text = (DOCS / page).read_text("utf-8")
    pointers = re.findall(r"`([a-z0-9_/]+\.py)`,\s+function\s+`(\w+)`", text)
    assert len(pointers) > 10
    assert [(path, name) for path, name in pointers if f"\ndef {name}(" not in (ROOT / path).read_text("utf-8")] == []


@pytest.mark.parametrize("room", sorted(rooms()))
def test_a_room_says_what_is_in_it(room):
    said = (ROOT / room / "__init__.py").read_text("utf-8")
    assert said.startswith('"""') and len(said) > 40


MODULES = {
    part for package in PACKAGES for path in (ROOT / package).rglob("*.py") for part in (path.stem, path.parent.name)
}


@pytest.mark.parametrize("room", sorted(rooms()))
def test_what_a_room_names_is_a_module_or_stands_in_it(room):
    opening = ast.get_docstring(ast.parse((ROOT / room / "__init__.py").read_text("utf-8"))) or ""
    sources = [path.read_text("utf-8") for path in (ROOT / room).rglob("*.py")]
    named = set(re.findall(r"`([a-z_0-9]+)(?:\.py)?`", opening)) - MODULES
    assert {name for name in named if not any(re.search(rf"\b{name}\b *(\(|:|=)", text) for text in sources)} == set()


def imports_of(path: Path) -> set[str]:
    """Modules that a file imports anywhere, also where a function does; not those of type checking alone."""
    found, waiting = set(), [ast.parse(path.read_text("utf-8"))]
    while waiting:
        node = waiting.pop()
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test):
            continue
        if isinstance(node, ast.ImportFrom) and node.module:
            found |= {node.module, *(f"{node.module}.{name.name}" for name in node.names)}
        elif isinstance(node, ast.Import):
            found |= {name.name for name in node.names}
        waiting += ast.iter_child_nodes(node)
    return found


def test_no_file_is_imported_by_what_it_imports():
    files = {path for package in PACKAGES for path in (ROOT / package).rglob("*.py") if path.name != "__init__.py"}
    named = {".".join(path.relative_to(ROOT).with_suffix("").parts): path for path in files}
    left = {name: imports_of(path) & set(named) - {name} for name, path in named.items()}
    assert sum(map(len, left.values())) > 1000
    while leaves := {name for name, wanted in left.items() if not wanted & set(left)}:
        left = {name: wanted for name, wanted in left.items() if name not in leaves}
    while unused := set(left) - set().union(*left.values()):
        left = {name: wanted for name, wanted in left.items() if name not in unused}
    assert sorted(left) == []
