"""What `import protocols`, `equalizer`, `analysis` and `study` offer, and what that costs."""

import re
import subprocess
import sys
from dataclasses import replace
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

import analysis
import equalizer
import study

PACKAGES = ("protocols", "equalizer", "analysis", "study")
ROOT = Path(__file__).parents[2]
HEAVY = ("numpy", "scipy", "numba", "pandas", "matplotlib", "h5py", "pydantic", "textual")


@pytest.mark.parametrize("name", PACKAGES)
def test_every_exported_name_is_there_and_described(name):
    package = import_module(name)
    assert package.__all__ == sorted(package.__all__)
    assert set(package.__all__) <= set(dir(package))
    for exported in package.__all__:
        found = getattr(package, exported)
        described = isinstance(found, dict) or (found.__doc__ and not found.__doc__.startswith(f"{found.__name__}("))
        assert described, f"{name}.{exported} says nothing of itself"


@pytest.mark.parametrize("name", PACKAGES)
def test_the_reference_describes_every_exported_name(name):
    page = (ROOT / "docs" / "api" / f"{name}.md").read_text("utf-8")
    homes = [home.replace(":", ".") for home in import_module(name)._HOME.values()]
    assert sorted(re.findall(r"^::: (\S+)$", page, re.MULTILINE)) == sorted(homes)


@pytest.mark.parametrize("name", PACKAGES)
def test_an_import_alone_loads_nothing_heavy(name):
    code = f"import sys, {name}; print(' '.join(m for m in {HEAVY!r} if m in sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == []


@pytest.mark.parametrize("name", PACKAGES)
def test_a_name_that_is_not_there_is_an_attribute_error(name):
    with pytest.raises(AttributeError, match="nothing_of_the_kind"):
        _ = import_module(name).nothing_of_the_kind


READERS = ("read_recording", "read_trials", "read_mechanical_model", "read_identified_model")


@pytest.mark.parametrize("reader", READERS)
def test_a_file_that_is_named_by_text_and_is_not_there_is_said_in_words(reader, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(study.StudyError, match="nowhere"):
        getattr(study, reader)("nowhere.file")


def test_a_file_that_is_named_by_text_is_written_and_read(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    force, motion = (
        equalizer.Signal(np.ones((50, 1)), 1000.0, *of) for of in (("force", "N", ("fx",)), ("position", "m", ("x",)))
    )
    recording = equalizer.Recording("cart", force, motion)
    mechanical = equalizer.MechanicalModel("cart", "position", *(np.eye(1) for _ in range(5)))
    matrices = np.eye(2) / 2, np.ones((2, 1)), np.ones((1, 2)), np.zeros((1, 1))
    identified = equalizer.IdentifiedModel(*matrices, 1000.0, (5.0, 35.0), "N", "m", ("fx",), ("x",))
    study.write_recording("cart.h5", recording)
    study.write_mechanical_model("cart.toml", mechanical)
    study.write_identified_model("model.h5", identified)
    assert study.read_recording("cart.h5").command.channels == ("fx",)
    assert study.read_mechanical_model("cart.toml").name == "cart"
    assert study.read_identified_model("model.h5").band_hz == (5.0, 35.0)


CALCULATIONS = (equalizer.identify, equalizer.fit_mechanical_model, analysis.first_structure, analysis.diagnose)


@pytest.mark.parametrize("calculation", CALCULATIONS)
@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"command": {"samples": np.ones((49, 1))}}, "command has 49 samples, but response has 50"),
        ({"command": {"sample_rate_hz": 2000.0}}, "command is at 2000 Hz, but response at 1000 Hz"),
        ({"response": {"unit": "mm"}}, "response x is in mm; convert its samples to SI"),
    ],
)
def test_one_recording_may_be_given_and_is_refused_where_its_signals_do_not_agree(calculation, changes, said):
    signals = {
        "command": equalizer.Signal(np.ones((50, 1)), 1000.0, "force", "N", ("fx",)),
        "response": equalizer.Signal(np.ones((50, 1)), 1000.0, "position", "m", ("x",)),
    }
    signals |= {name: replace(signals[name], **change) for name, change in changes.items()}
    with pytest.raises(ValueError, match=said):
        calculation(equalizer.Recording("cart", **signals))


def test_a_structure_that_does_not_exist_is_refused_by_name():
    signal = equalizer.Signal(np.ones((50, 1)), 1000.0, "force", "N", ("fx",))
    recording = equalizer.Recording("cart", signal, replace(signal, quantity="position", unit="m"))
    with pytest.raises(ValueError, match="there is no structure 'mass spring'; the structures are mass-spring"):
        analysis.first_structure(recording, "mass spring")


@pytest.mark.parametrize("as_path", [str, Path])
def test_a_protocol_is_read_from_a_path_or_its_text(as_path, tmp_path):
    file = tmp_path / "own.toml"
    file.write_text(study.read_study_protocol("direction_threshold").text, "utf-8")
    assert study.read_study_protocol(as_path(file), as_path(tmp_path)).path == file


def test_a_session_may_be_filed_under_a_folder_that_is_named_by_text(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    folder = study.simulate_session(study.read_study_protocol("direction_training"), "data")
    assert study.read_trials(str(folder.path / "trials.csv"))
    assert study.analyze_data("data", "results").report.exists()
