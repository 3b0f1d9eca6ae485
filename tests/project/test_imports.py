"""What is loaded when: help is instant, and the headless packages stay headless."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
HEAVY = ("numpy", "scipy", "numba", "pandas", "statsmodels", "matplotlib", "h5py", "textual")
SELDOM = ("scipy.signal", "scipy.optimize", "scipy.interpolate", "scipy.integrate", "scipy.sparse", "scipy.ndimage")
"""Parts of SciPy that load most of the others, or are needed by few."""


def loaded_by(statement: str) -> set[str]:
    script = f"import sys; sys.argv = ['hapteq']\n{statement}\nprint(*sys.modules)"
    done = subprocess.run(
        [sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True, check=True, timeout=120
    )
    modules = done.stdout.split()
    return {name.split(".")[0] for name in modules} | {"scipy.stats", *SELDOM}.intersection(modules)


def test_help_loads_nothing_heavy():
    loaded = loaded_by(
        "from study.cli.main import main\n"
        "from study.cli.command_table import LoadedWhenCalled\n"
        "import io, contextlib\n"
        "with contextlib.redirect_stdout(io.StringIO()): main(['--help'])\n"
        "assert 'study.cli.diagnose' not in sys.modules\n"
        "for command in LoadedWhenCalled().values(): str(command.help)"
    )
    assert loaded.isdisjoint(HEAVY), sorted(loaded & set(HEAVY))


@pytest.mark.parametrize("package", ["protocols", "equalizer.signals", "study.session", "study.devices.opening"])
def test_headless_packages_load_no_screen_and_no_plots(package):
    modules = sorted((ROOT / package.replace(".", "/")).rglob("*.py"))
    names = [".".join(m.relative_to(ROOT).with_suffix("").parts) for m in modules if m.stem != "__init__"]
    loaded = loaded_by(f"import {', '.join(names or [package])}")
    assert loaded.isdisjoint({"textual", "rich", "typer", "matplotlib"})


def test_a_session_begins_and_a_file_is_checked_without_statistics_and_plots():
    loaded = loaded_by(
        "import study.tui.engine.engine_commands, study.workflows.session.end_sitting\n"
        "import study.workflows.files.validate_apart\n"
        "import study.devices.safe, study.devices.rigs_by_name"  # as a device is opened
    )
    assert "numba" in loaded
    slow = {"scipy.stats", "statsmodels", "pandas", "matplotlib"}
    assert loaded.isdisjoint(slow), sorted(loaded & slow)


def test_the_process_that_draws_loads_no_arrays_no_disk_and_no_device():
    screens = sorted((ROOT / "study" / "tui" / "screens").glob("*.py"))
    names = [f"study.tui.screens.{module.stem}" for module in screens if module.stem != "__init__"]
    apps = ("study.cli.study", "study.cli.resume", "study.cli.watch", "study.tui.app.app", "study.tui.app.sitting_screens", "study.tui.watch.watch_app")
    everything = ", ".join((*apps, *names))
    loaded = loaded_by(f"import {everything}")
    assert "textual" in loaded
    heavy = {"numpy", "scipy", "numba", "pandas", "statsmodels", "matplotlib", "h5py", "pydantic", "filelock"}
    assert loaded.isdisjoint(heavy), sorted(loaded & heavy)


def test_a_diagnosis_begins_without_what_only_some_of_them_need():
    loaded = loaded_by("import study.workflows.diagnosis.diagnose_recordings")
    assert "numba" in loaded
    needless = {"pandas", "statsmodels", "matplotlib", "jinja2", "scipy.stats", *SELDOM}
    assert loaded.isdisjoint(needless), sorted(loaded & needless)
