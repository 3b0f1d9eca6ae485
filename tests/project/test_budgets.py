"""The size budgets: orchestrators grow first, so a machine watches them."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PACKAGES = ("protocols", "equalizer", "analysis", "study")
SOURCES = sorted(path for package in PACKAGES for path in (ROOT / package).rglob("*.py"))

FILE_LINES = 250
FUNCTION_LINES = 40


def functions(path: Path):
    tree = ast.parse(path.read_text())
    return [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)]


def lines_of(node: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    """Without the docstring: explaining is not growing."""
    total = (node.end_lineno or node.lineno) - node.lineno + 1
    first = node.body[0]
    is_docstring = isinstance(first, ast.Expr) and isinstance(first.value, ast.Constant)
    return total - ((first.end_lineno or first.lineno) - first.lineno + 1 if is_docstring else 0)


@pytest.mark.parametrize("path", SOURCES, ids=lambda p: str(p.relative_to(ROOT)))
def test_a_file_holds_one_thing(path):
    assert len(path.read_text().splitlines()) <= FILE_LINES
    long = {f.name: lines_of(f) for f in functions(path) if lines_of(f) > FUNCTION_LINES}
    assert not long, f"functions over {FUNCTION_LINES} lines: {long}"


def test_nobody_takes_a_soup_of_keywords():
    soup = [f"{path.name}:{f.name}" for path in SOURCES for f in functions(path) if f.args.kwarg is not None]
    assert soup == []


def test_our_classes_inherit_from_nothing_with_code_in_it():
    """Protocols, enums, exceptions and named tuples aside, at most one level of our own."""
    allowed = {"Protocol", "Enum", "IntEnum", "StrEnum", "ValueError", "Exception", "RuntimeError", "NamedTuple"}
    families: dict[str, list[str]] = {}
    for path in SOURCES:
        for node in ast.walk(ast.parse(path.read_text())):
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
