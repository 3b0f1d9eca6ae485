"""Three packages compute. The import contracts see imports; this sees what is called."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
FRONTS = {ROOT / package / "__init__.py" for package in ("protocols", "equalizer", "analysis")}
"""They import what is asked for, when it is asked for (`test_python_interface`)."""
PURE = [
    *(ROOT / "protocols").rglob("*.py"),
    *(ROOT / "equalizer").rglob("*.py"),
    *(ROOT / "analysis").rglob("*.py"),
    *(ROOT / "study" / "session").rglob("*.py"),
]
FORBIDDEN_NAMES = {"open", "print", "input", "exec", "eval", "__import__"}
FORBIDDEN_MODULES = {
    "time", "os", "pathlib", "random", "subprocess", "threading", "multiprocessing", "socket", "logging", "tempfile",
    "shutil", "urllib", "http", "sys", "signal", "importlib", "h5py", "rich", "typer", "textual",
}  # fmt: skip
FORBIDDEN_ATTRIBUTES = {"read_text", "write_text", "read_bytes", "write_bytes", "import_module", "now", "utcnow"}


def impurities(source: str) -> list[str]:
    found = []
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in FORBIDDEN_NAMES:
            found.append(f"line {node.lineno}: {node.func.id}()")
        if isinstance(node, ast.Attribute) and node.attr in FORBIDDEN_ATTRIBUTES:
            found.append(f"line {node.lineno}: .{node.attr}")
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr == "astimezone":
            found += [] if node.args else [f"line {node.lineno}: .astimezone() reads the zone of the machine"]
        modules = []
        if isinstance(node, ast.Import):
            modules = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            modules = [node.module or ""]
        found += [f"line {node.lineno}: import {m}" for m in modules if m.split(".")[0] in FORBIDDEN_MODULES]
    return found


@pytest.mark.parametrize("path", sorted({*PURE} - FRONTS), ids=lambda p: str(p.relative_to(ROOT)))
def test_a_pure_module_touches_no_file_no_clock_and_no_screen(path):
    assert impurities(path.read_text()) == []


@pytest.mark.parametrize(
    "source",
    [
        "open('a')",
        "from pathlib import Path",
        "import time",
        "x.read_text()",
        "print(1)",
        "import importlib.util",
        "t.astimezone()",
    ],
)
def test_the_checker_sees_what_it_should(source):
    assert impurities(source)


def test_matplotlib_stays_in_figures_and_pages():
    users = {
        path.relative_to(ROOT).parts[:2]
        for package in ("protocols", "equalizer", "analysis", "study")
        for path in (ROOT / package).rglob("*.py")
        if "matplotlib" in path.read_text()
        and "import matplotlib" in path.read_text().replace("from matplotlib", "import matplotlib")
    }
    assert users == {("analysis", "figures")}
