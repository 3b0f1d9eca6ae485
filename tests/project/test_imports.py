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
    modules = set(done.stdout.split())
    ours = {name for name in modules if name.partition(".")[0] in ("protocols", "equalizer", "analysis", "study")}
    return {name.split(".")[0] for name in modules} | ours | {"scipy.stats", *SELDOM} & modules


def test_help_loads_nothing_heavy():
    loaded = loaded_by(
        "from study.cli.main import main\n"
        "from study.cli.command_table import LazyCommands\n"
        "import io, contextlib\n"
        "with contextlib.redirect_stdout(io.StringIO()): main(['--help'])\n"
        "assert 'study.cli.diagnose' not in sys.modules\n"
        "for command in LazyCommands().values(): str(command.help)"
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
        "import study.workflows.files.validate_in_process\n"
        "import study.devices.safe, study.devices.rigs_by_name"  # as a device is opened
    )
    assert "numba" in loaded
    slow = {"scipy.stats", "statsmodels", "pandas", "matplotlib"}
    assert loaded.isdisjoint(slow), sorted(loaded & slow)
    # What compares two days of a device, and effects of a model, compile as much as all the rest.
    needless = ("analysis.device_change", "equalizer.effects", "study.devices.replay")
    assert not any(name.startswith(needless) for name in loaded)


def test_the_process_that_draws_loads_no_arrays_no_disk_and_no_device():
    screens = sorted((ROOT / "study" / "tui" / "screens").glob("*.py"))
    names = [f"study.tui.screens.{module.stem}" for module in screens if module.stem != "__init__"]
    apps = (
        "study.cli.study",
        "study.cli.resume",
        "study.cli.watch",
        "study.tui.app.app",
        "study.tui.app.sitting_screens",
        "study.tui.watch.watch_app",
    )
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


CLOSURE_OF_DIAGNOSE = 200
"""Our own files that are loaded before a diagnosis with a given model begins: 200 in November 2026, of which 47 are the
catalogue of effects. The number may shrink only; what only some diagnoses need is imported where they need it: of a
friction that the search alone does not explain, force balance, impacts and discovery bring it to 239."""
OPTIONAL_ROOMS = (
    "analysis.diagnosis.contrast",  # only beside clean recordings
    "analysis.diagnosis.reference",
    "analysis.diagnosis.discovery",  # only where a model is given
    "analysis.diagnosis.first_model.fit_without_model",  # only without a given model
    "analysis.diagnosis.first_model.one_motion_per_force",
    "analysis.diagnosis.first_model.model_from_balance",
    "analysis.diagnosis.errors.windows",  # only where the device drifts or its command is fed back
    "analysis.diagnosis.forces.force_measure",  # only where forces are compared
    "analysis.diagnosis.balance",  # only without a given model, or where the search leaves something unexplained
    "analysis.diagnosis.confirm.confirm_laws",  # only where a balance names laws
    "analysis.diagnosis.confirm.force_balance_measures",
    "analysis.diagnosis.confirm.decide_with_model",  # only where a search with a given model leaves something open
    "analysis.diagnosis.data.force_constant",  # only where commands are currents
    "analysis.diagnosis.search.impacts",  # only where the search leaves something open
    "analysis.diagnosis.next_experiment",  # only where an effect is named
    "equalizer.identification.mechanical",
    "analysis.figures",  # only once the answer is there
    "analysis.reports",
)


def test_a_diagnosis_loads_only_the_rooms_that_each_diagnosis_needs():
    ours = {name for name in loaded_by("import study.workflows.diagnosis.diagnose_recordings") if "." in name}
    modules = {name for name in ours if (ROOT / f"{name.replace('.', '/')}.py").exists()}
    assert sorted(name for name in modules if name.startswith(OPTIONAL_ROOMS)) == []
    assert len(modules) <= CLOSURE_OF_DIAGNOSE
