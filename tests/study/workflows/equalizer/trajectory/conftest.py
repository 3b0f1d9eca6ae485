"""Models of a synthetic device in a folder, and a plan to play a table."""

from pathlib import Path

import pytest

from study.store.formats.identified_model_file import write_identified_model
from study.store.formats.trajectory_file import write_trajectory
from study.workflows.equalizer.equalize_trajectory import EqualizePlan
from tests.study.workflows.equalizer.trajectory.plans import model_of, noise, table

PLACES = {"left": ((-0.03, 0.0, 0.0), 0.0), "centre": ((0.0, 0.0, 0.0), 0.1), "right": ((0.03, 0.0, 0.0), 0.2)}
"""With the share by which resonances have moved there."""


@pytest.fixture(scope="session")
def folder(plants, tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("equalize")
    for name, (place_m, shift) in PLACES.items():
        write_identified_model(folder / f"{name}.h5", model_of(plants.omega_like(shift), place_m))
    middle = PLACES["centre"]
    write_identified_model(folder / "wide.h5", model_of(plants.omega_like(middle[1]), middle[0], (5.0, 400.0)))
    write_trajectory(folder / "wanted.csv", table(noise(plants)))
    write_trajectory(folder / "loud.csv", table(noise(plants, rms=3.5)[600:1400]))
    return folder


@pytest.fixture
def plan(folder, tmp_path) -> EqualizePlan:
    return EqualizePlan((folder / "centre.h5",), folder / "wanted.csv", tmp_path / "forces.csv")
