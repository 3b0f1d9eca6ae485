"""Machine code on disk is kept in step with every source whose numbers are compiled into it."""

import ast
from pathlib import Path

import pytest

from study.devices.governor.compiling import compute_fingerprint

DEVICES = Path(__file__).parents[4] / "study" / "devices"
COMPILED = {
    "governor": ("cells", "confine", "feedback", "govern", "plausibility"),
    "simulated": ("drives", "dynamics", "inertia", "inlined", "layout", "linkage", "sensors"),
}
WATCHED = {"study.devices.rig"}
"""Beyond the folder itself."""
TYPES = {"equalizer.signals.signal"}
"""Names for the type checker alone."""


@pytest.mark.parametrize("folder", COMPILED)
def test_what_is_compiled_imports_nothing_that_is_not_watched(folder):
    outside = set()
    for name in COMPILED[folder]:
        for node in ast.walk(ast.parse((DEVICES / folder / f"{name}.py").read_text("utf-8"))):
            if isinstance(node, ast.ImportFrom) and node.module and node.module.split(".")[0] in ("study", "equalizer"):
                modules = {node.module} if node.module != "study.devices" else {
                    f"study.devices.{alias.name}" for alias in node.names
                }  # fmt: skip
                outside |= {module for module in modules if not module.startswith(f"study.devices.{folder}")}
    assert outside <= WATCHED | TYPES


def test_a_change_of_any_watched_file_is_another_fingerprint(tmp_path):
    (tmp_path / "folder").mkdir()
    inside, beyond = tmp_path / "folder" / "a.py", tmp_path / "rig.py"
    inside.write_text("A = 1\n")
    beyond.write_text("B = 1\n")
    found = [compute_fingerprint(tmp_path / "folder", beyond)]
    beyond.write_text("B = 2\n")
    found.append(compute_fingerprint(tmp_path / "folder", beyond))
    inside.write_text("A = 2\n")
    found.append(compute_fingerprint(tmp_path / "folder", beyond))
    assert len(set(found)) == 3


def test_compiled_layers_watch_the_rigs_layout():
    for path in (
        DEVICES / "governor" / "govern.py",
        DEVICES / "simulated" / "compiled.py",
        DEVICES / "replay" / "replay_rig.py",
    ):
        assert 'parents[1] / "rig.py"' in path.read_text("utf-8")
