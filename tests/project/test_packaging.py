"""What is installed on a user's machine, and what happens beside files of other programs."""

import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
HAPTEQ = Path(sys.executable).parent / "hapteq"

needs_command = pytest.mark.skipif(not HAPTEQ.exists(), reason="hapteq is not installed in this environment")


@pytest.fixture(scope="module")
def wheel(tmp_path_factory) -> Path:
    from hatchling.builders.wheel import WheelBuilder

    out = tmp_path_factory.mktemp("dist")
    (built,) = WheelBuilder(str(ROOT)).build(directory=str(out), versions=["standard"])
    return Path(built)


def test_the_wheel_holds_the_four_packages_and_the_launcher_only(wheel):
    names = zipfile.ZipFile(wheel).namelist()
    top = {name.split("/")[0] for name in names if ".dist-info" not in name}
    assert top == {"study", "equalizer", "analysis", "protocols", "hapteq_launcher.py"}


def test_the_wheel_carries_the_shipped_protocols_and_the_report_template(wheel):
    names = zipfile.ZipFile(wheel).namelist()
    shipped = {"direction_threshold", "direction_training", "ellipsoid", "sweep", "sweep_band", "multisine"}
    assert {f"protocols/{name}.toml" for name in shipped} <= set(names)
    assert any(name.startswith("analysis/reports/") and name.endswith((".html", ".jinja", ".j2")) for name in names)


def test_the_wheel_carries_the_maps_for_imports(wheel):
    from study.importing.map_library import list_shipped_maps

    assert {f"study/importing/maps/{name}.toml" for name in list_shipped_maps()} <= set(
        zipfile.ZipFile(wheel).namelist()
    )


def test_the_wheel_carries_the_sources_of_an_exported_controller(wheel):
    folder = "study/workflows/equalizer/controller"
    names = {f"{folder}/{name}" for name in ("controller.h", "example_loop.c", "check_controller.c")}
    assert names <= set(zipfile.ZipFile(wheel).namelist())


def test_the_wheel_carries_the_bare_loop_that_the_doctor_times(wheel):
    assert "study/workflows/checks/bare_loop.c" in zipfile.ZipFile(wheel).namelist()


@needs_command
def test_the_command_works_beside_a_strangers_analysis(tmp_path):
    (tmp_path / "analysis.py").write_text("raise SystemExit('the stranger ran')\n")
    (tmp_path / "study.py").write_text("raise SystemExit('the stranger ran')\n")
    done = subprocess.run([HAPTEQ, "--help"], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "rehearse" in done.stdout


@needs_command
@pytest.mark.parametrize("name", ["analysis", "study", "protocols", "equalizer"])
def test_a_stranger_on_the_import_path_is_named(tmp_path, name):
    stranger = tmp_path / f"{name}.py"
    stranger.write_text("raise SystemExit('the stranger ran')\n")
    done = subprocess.run(
        [HAPTEQ, "--help"], env={"PYTHONPATH": str(tmp_path)}, capture_output=True, text=True, check=False
    )
    assert done.returncode == 1
    assert f"Another program's files hide those of hapteq: {stranger.resolve()}." in done.stderr
    assert "Nothing was started." in done.stderr


def test_the_constraints_pin_versions_and_name_no_host():
    lines = [line for line in (ROOT / "constraints.txt").read_text().splitlines() if not line.startswith("#")]
    assert lines
    assert all(line.count("==") == 1 and "/" not in line and "@" not in line for line in lines)


def test_every_direct_dependency_is_pinned():
    import re
    import tomllib

    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    wanted = project["dependencies"] + project["optional-dependencies"]["test"]
    names = {re.split(r"[<>=\[; ]", requirement)[0].lower() for requirement in wanted}
    pinned = {line.split("==")[0].lower() for line in (ROOT / "constraints.txt").read_text().splitlines()}
    assert names <= pinned
