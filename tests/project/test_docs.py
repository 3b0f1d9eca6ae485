"""What the documentation shows is run as it stands."""

import re
from pathlib import Path

import numpy as np
import pytest
from typer.main import get_command

from equalizer.plant.identified_model import IdentifiedModel
from study.cli.main import app
from study.store.formats.identified_model_file import write_identified_model

DOCS = Path(__file__).parents[2] / "docs"
VAGUE = re.compile(r"(\b|_)(whoever|whatever|nobody|somebody|anybody|everybody)(\b|_)", re.IGNORECASE)
"""Words for people whose part (participant, experimenter, person at the handle) has to be said, and for things that can
be named."""


def test_people_are_named_by_their_part():
    root = DOCS.parent
    written = [*DOCS.rglob("*.md"), *DOCS.rglob("*.json"), root / "README.md", *(root / "protocols").glob("*.toml")]
    found = [f"{path.name}: {match.group()}" for path in written for match in VAGUE.finditer(path.read_text("utf-8"))]
    assert found == []


def test_code_and_tests_name_people_and_things():
    root = DOCS.parent
    folders = ("protocols", "equalizer", "analysis", "study", "tests")
    code = [path for folder in folders for path in (root / folder).rglob("*.py") if path != Path(__file__)]
    assert [path.name for path in code if VAGUE.search(path.read_text("utf-8"))] == []


def test_help_names_people_by_their_part():
    parts = [root := get_command(app), *root.commands.values()]
    parts += [part for group in parts[1:] if hasattr(group, "commands") for part in group.commands.values()]
    said = [text for part in parts for text in (part.help, *(getattr(p, "help", "") for p in part.params)) if text]
    assert len(said) > 100
    assert [text for text in said if VAGUE.search(text)] == []


@pytest.fixture
def plant(plants, tmp_path, monkeypatch):
    """A plant whose model is the file model.h5 of the folder in which the pages are run."""
    known = plants.omega_like()
    channels = ("fx", "fy", "fz"), ("ax", "ay", "az")
    model = IdentifiedModel(known.A, known.B, known.C, np.zeros((3, 3)), 1000.0, (5.0, 35.0), "N", "m/s^2", *channels)
    write_identified_model(tmp_path / "model.h5", model)
    monkeypatch.chdir(tmp_path)
    return known


def test_the_forces_of_the_python_page_are_computed(plant):
    code = re.findall(r"```python\n(.*?)```", (DOCS / "python.md").read_text("utf-8"), re.DOTALL)
    (equalized,) = [part for part in code if "equalize(" in part]
    time_s = np.arange(1000) / 1000.0
    wanted = np.zeros((1000, 3))
    wanted[:, 0] = np.sin(np.pi * time_s) ** 2 * np.sin(2 * np.pi * 20.0 * time_s)
    names: dict = {"wanted": wanted}
    exec(equalized, names)
    assert names["found"].forces.samples.shape == (1000, 3)
    assert names["found"].error < 0.05
    np.testing.assert_allclose(names["model"].A, plant.A)


def test_the_rendering_loop_of_the_equalizer_page_runs(plant):
    (code,) = re.findall(r"```python\n(.*?)```", (DOCS / "equalizer.md").read_text("utf-8"), re.DOTALL)
    names: dict = {}
    exec(code, names)
    np.testing.assert_allclose(names["start"].live.problem.A, plant.A)
    assert names["error"] < 0.05
    assert names["forces"].shape == (500, 3)
    assert 0 < names["loss"].full_error < names["loss"].error < 1
