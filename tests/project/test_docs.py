"""What the documentation shows is run as it stands."""

import re
from pathlib import Path

import numpy as np

from equalizer.plant.identified_model import IdentifiedModel
from study.store.identified_model_file import write_identified_model

DOCS = Path(__file__).parents[2] / "docs"


def test_the_rendering_loop_of_the_equalizer_page_runs(plants, tmp_path, monkeypatch):
    plant = plants.omega_like()
    channels = ("fx", "fy", "fz"), ("ax", "ay", "az")
    model = IdentifiedModel(plant.A, plant.B, plant.C, np.zeros((3, 3)), 1000.0, (5.0, 35.0), "N", "m/s^2", *channels)
    write_identified_model(tmp_path / "model.h5", model)
    monkeypatch.chdir(tmp_path)
    (code,) = re.findall(r"```python\n(.*?)```", (DOCS / "equalizer.md").read_text("utf-8"), re.DOTALL)
    names: dict = {}
    exec(code, names)
    np.testing.assert_allclose(names["start"].live.problem.A, plant.A)
    assert names["error"] < 0.05
    assert names["forces"].shape == (500, 3)
    assert 0 < names["loss"].full_error < names["loss"].error < 1
