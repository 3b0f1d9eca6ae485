"""The budgets of size: orchestrators grow first, so a machine watches them.

What does not keep a budget yet stands in a list here. The lists only shrink: an entry that is no longer needed fails.
"""

import ast
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[2]
PACKAGES = ("protocols", "equalizer", "analysis", "study")
SOURCES = sorted(path for package in PACKAGES for path in (ROOT / package).rglob("*.py"))
TESTS = sorted((ROOT / "tests").rglob("*.py"))

FUNCTION_LINES = 40
FILE_LINES, LONG_FILE_LINES = 500, 300
"""No file is longer than the first; one longer than the second stands in the list."""
FILES_IN_A_FOLDER = 20
TEST_FILE_LINES, TEST_FILES_IN_A_FOLDER = 300, 25
"""Test files have no list of exceptions: a longer one is split by what it tests."""
SMALL_FILE_LINES = 60
"""A smaller file that a single neighbour imports belongs into that neighbour."""

CATALOGUES = {
    "equalizer/effects": "one physics a file",
    "study/cli": "one command a file",
    "study/tui/screens": "one screen a file",
    "study/participants": "one kind of simulated participant a file",
    "study/store/formats": "one format a file",
}
"""Folders of things of one kind, each in a file that is found by its name: neither crowded nor with files too small."""

LONG_FILES = {"analysis/diagnosis/limits.py"}
SMALL_BESIDE_THEIR_IMPORTER = {
    "study/tui/app/load_screens.py",
    "study/tui/app/outcomes.py",
}


@cache
def tree_of(path: Path) -> ast.Module:
    return ast.parse(path.read_text("utf-8"))


@cache
def line_count(path: Path) -> int:
    return len(path.read_text("utf-8").splitlines())


def short(path: Path) -> str:
    return path.relative_to(ROOT).as_posix()


def functions(path: Path):
    return [node for node in ast.walk(tree_of(path)) if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)]


def lines_of(node: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    """Without the docstring: explaining is not growing."""
    total = (node.end_lineno or node.lineno) - node.lineno + 1
    first = node.body[0]
    is_docstring = isinstance(first, ast.Expr) and isinstance(first.value, ast.Constant)
    return total - ((first.end_lineno or first.lineno) - first.lineno + 1 if is_docstring else 0)


def importers() -> dict[Path, set[Path]]:
    """Which files import each file, at the top or within a function."""
    files = {".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__"): path for path in SOURCES}
    found: dict[Path, set[Path]] = {path: set() for path in SOURCES}
    for path in SOURCES:
        for node in ast.walk(tree_of(path)):
            names = []
            if isinstance(node, ast.Import):
                names = [alias.name for alias in node.names]
            elif isinstance(node, ast.ImportFrom):
                names = [node.module, *(f"{node.module}.{alias.name}" for alias in node.names)]
            for name in names:
                if name in files:
                    found[files[name]].add(path)
    return found


def test_no_function_is_long():
    long = [f"{short(path)}: {f.name}" for path in SOURCES for f in functions(path) if lines_of(f) > FUNCTION_LINES]
    assert long == []


def test_a_file_holds_one_thing():
    assert [short(path) for path in SOURCES if line_count(path) > FILE_LINES] == []
    long = {short(path) for path in SOURCES if line_count(path) > LONG_FILE_LINES}
    assert long - LONG_FILES == set(), "split it, or say in the list that it holds one thing"
    assert LONG_FILES - long == set(), "no longer long: take it from the list"


def test_a_folder_can_be_taken_in_at_a_glance():
    modules = [path.parent for path in SOURCES if path.name != "__init__.py"]
    full = {short(folder) for folder in modules if modules.count(folder) > FILES_IN_A_FOLDER}
    assert full - CATALOGUES.keys() == set(), "make rooms"
    assert all((ROOT / folder).is_dir() for folder in CATALOGUES)


def test_test_files_and_folders_stay_small():
    assert [short(path) for path in TESTS if line_count(path) > TEST_FILE_LINES] == []
    folders = [path.parent for path in TESTS]
    assert [short(each) for each in set(folders) if folders.count(each) > TEST_FILES_IN_A_FOLDER] == []


def test_a_small_file_is_no_part_of_a_single_neighbour():
    small = {
        short(path)
        for path, those in importers().items()
        if line_count(path) < SMALL_FILE_LINES
        and path.name != "__init__.py"
        and short(path.parent) not in CATALOGUES
        and {other.parent for other in those} == {path.parent}
        and len(those) == 1
    }
    assert small - SMALL_BESIDE_THEIR_IMPORTER == set(), "merge it into its importer"
    assert SMALL_BESIDE_THEIR_IMPORTER - small == set(), "no longer small and alone: take it from the list"


def test_no_function_takes_arbitrary_keyword_arguments():
    soup = [f"{path.name}:{f.name}" for path in SOURCES for f in functions(path) if f.args.kwarg is not None]
    assert soup == []


def test_our_classes_inherit_from_nothing_with_code_in_it():
    """Protocols, enums, exceptions and named tuples aside, at most one level of our own."""
    allowed = {"Protocol", "Enum", "IntEnum", "StrEnum", "ValueError", "Exception", "RuntimeError", "NamedTuple"}
    families: dict[str, list[str]] = {}
    for path in SOURCES:
        for node in ast.walk(tree_of(path)):
            if isinstance(node, ast.ClassDef):
                families[node.name] = [base.id for base in node.bases if isinstance(base, ast.Name)]
    for name, bases in families.items():
        for base in bases:
            if base in allowed or base not in families:
                continue
            deeper = [b for b in families[base] if b in families and b not in allowed]
            assert not deeper or base.endswith("Error"), f"{name} -> {base} -> {deeper}"


def test_no_unfinished_business_is_shipped():
    words = ("TODO", "FIXME", "XXX", "NotImplemented")
    found = [f"{p.relative_to(ROOT)}: {w}" for p in SOURCES for w in words if w in p.read_text()]
    assert found == []
