"""Nothing but `study.devices.opening` leads to a force: names in the source, and the import contract itself."""

import ast
import os
import shutil
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]

NAMED_IN = {
    "SafeDevice": {"study/devices/opening.py"},
    "RIGS_BY_NAME": {"study/devices/opening.py"},
    "build_rig": {"study/devices/opening.py"},
    "make_simulated_rig": set(),
    "make_replay_rig": {"study/devices/rigs_by_name.py"},
    "build_omega3": {"study/devices/rigs_by_name.py"},
    "open_force_dimension_rig": {"study/devices/rigs_by_name.py"},
    "ForceDimensionRig": {"study/devices/force_dimension/open_rig.py"},
    "set_force": {
        "study/devices/force_dimension/handle.py",
        "study/devices/force_dimension/rig.py",
        "study/devices/force_dimension/findings.py",  # zero only
        "study/devices/force_dimension/watchdog_check.py",  # zero only
    },
    "dhdSetForce": {
        "study/devices/force_dimension/handle.py",
        "study/devices/force_dimension/loop_cells.py",
        "study/devices/force_dimension/library.py",
    },
    "CompiledRunner": {"study/devices/safe.py"},
    "SteppedRunner": {
        "study/devices/safe.py",
        "study/devices/drive/realtime_drive.py",  # which asks it for ticks
    },
    "CompiledTicks": {"study/devices/drive/stepped_runner.py"},
    "write_once": {"study/devices/force_dimension/tick_io.py", "study/devices/force_dimension/rig.py"},
    "repeat_zero_once": {
        "study/devices/force_dimension/tick_io.py",
        "study/devices/force_dimension/rig.py",  # zero only
    },
    "hold_unchecked": {"study/devices/force_dimension/force_limit_check.py"},
    "read_reported_without_cap_n": {"study/devices/force_dimension/force_limit_check.py"},
    "StandbyThread": set(),
    "run_block": set(),
}
"""Where else than at home a name may stand at all: imported, called, under another name or as a string."""

CALLED_IN = {
    "CompiledRig": {"study/devices/simulated/omega3.py", "study/devices/replay/replay_rig.py"},
    "advance": {"study/devices/drive/runner.py"},
    "write": {
        "study/devices/drive/compiled_drive.py",
        "study/devices/drive/stepped_runner.py",
        "study/devices/onset_line.py",  # to a serial line, no rig
    },
}
"""`write` and `advance` count inside study/devices only: files are written elsewhere."""

ELSEWHERE = ("cli", "tui", "evaluation", "workflows", "store", "session", "participants")


def names_in(node: ast.AST) -> set[str]:
    match node:
        case ast.Name(id=name) | ast.Attribute(attr=name) | ast.Constant(value=str(name)):
            return {name}
        case ast.alias(name=name):
            return {name.split(".")[-1]}
    return set()


def defines(tree: ast.Module, name: str) -> bool:
    targets = {t.id for n in tree.body if isinstance(n, ast.AnnAssign) and isinstance(t := n.target, ast.Name)}
    return name in targets | {n.name for n in tree.body if isinstance(n, ast.ClassDef | ast.FunctionDef)}


@cache
def sources(folder: Path) -> dict[str, tuple[ast.Module, frozenset[str]]]:
    """Of each file of the study: what it is, and all names in it."""
    trees = {
        path.relative_to(folder).as_posix(): ast.parse(path.read_text()) for path in (folder / "study").rglob("*.py")
    }
    return {
        path: (tree, frozenset[str]().union(*(names_in(node) for node in ast.walk(tree))))
        for path, tree in trees.items()
    }


def namers(name: str, folder: Path) -> set[str]:
    return {path for path, (tree, names) in sources(folder).items() if name in names and not defines(tree, name)}


def callers(name: str) -> set[str]:
    folder = "study/" if name == "CompiledRig" else "study/devices/"
    found = set()
    for path, (tree, names) in sources(ROOT).items():
        if path.startswith(folder) and name in names:
            calls = [node.func for node in ast.walk(tree) if isinstance(node, ast.Call)]
            if any(getattr(called, "id", getattr(called, "attr", None)) == name for called in calls):
                found.add(path)
    return found


@pytest.mark.parametrize("name", NAMED_IN)
def test_only_the_opening_and_the_safety_layer_name_what_drives_a_device(name):
    assert namers(name, ROOT) == NAMED_IN[name]


@pytest.mark.parametrize("name", CALLED_IN)
def test_only_the_safety_layer_calls_a_rig(name):
    assert callers(name) == CALLED_IN[name]


@pytest.mark.parametrize(
    "around",
    [
        "import x\nx.SafeDevice(1)",
        "from x import SafeDevice as harmless",
        "getattr(x, 'SafeDevice')",
        "def build():\n    from x import SafeDevice\n    return SafeDevice",
    ],
)
def test_the_search_for_names_finds_a_planted_one(tmp_path, around):
    (tmp_path / "study").mkdir()
    (tmp_path / "study" / "around.py").write_text(around)
    assert namers("SafeDevice", tmp_path) == {"study/around.py"}


@pytest.fixture(scope="module")
def tree(tmp_path_factory):
    """A copy of the packages with a module in each that goes around the door, to every module behind it."""
    root = tmp_path_factory.mktemp("tree")
    for package in ("study", "equalizer", "analysis", "protocols"):
        shutil.copytree(
            ROOT / package, root / package, ignore=lambda _, names: [n for n in names if "__pycache__" in n]
        )
    (root / "study" / "devices" / "brand_new.py").write_text("")
    shutil.copy(ROOT / "pyproject.toml", root)
    return root


def contract(tree: Path) -> subprocess.CompletedProcess:
    lint = [sys.executable, "-c", "from importlinter.cli import lint_imports_command as run; run()"]
    return subprocess.run(
        [*lint, "--contract", "one-door", "--no-cache"],
        cwd=tree,
        env=os.environ | {"COLUMNS": "300", "PYTHONPATH": str(tree)},
        capture_output=True,
        text=True,
        timeout=60,
    )


def modules_behind_the_door(tree: Path) -> set[str]:
    folder = tree / "study" / "devices"
    names = {".".join(p.relative_to(tree).with_suffix("").parts) for p in folder.rglob("*.py") if p.stem != "__init__"}
    return names - {f"study.devices.{public}" for public in ("opening", "device", "clock")}


def test_public_modules_pass_the_import_contract(tree):
    answer = contract(tree)
    assert "1 kept, 0 broken" in answer.stdout, answer.stdout + answer.stderr


def test_every_other_module_of_the_devices_is_behind_the_door_and_a_new_one_too(tree):
    behind = sorted(modules_behind_the_door(tree))
    assert "study.devices.brand_new" in behind
    around = [tree / "study" / package / "around.py" for package in ELSEWHERE]
    for path in around:
        path.write_text("def f():\n" + "".join(f"    import {module}\n" for module in (*behind, "study.devices")))
    try:
        answer = contract(tree)
    finally:
        for path in around:
            path.unlink()
    assert answer.returncode == 1
    for package in ELSEWHERE:
        for module in (*behind, "study.devices"):
            assert f"study.{package}.around -> {module} " in answer.stdout
