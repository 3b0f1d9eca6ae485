"""A workspace of 60 mm along which the synthetic device changes, and models identified in it from noisy sweeps."""

import importlib.util
import sys
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from equalizer.identification.state_space.identify import identify
from equalizer.identification.state_space.settings import IdentificationSettings
from equalizer.plant.identified_model import IdentifiedModel
from equalizer.tracking.feedforward.quality import ResponseQuality, measure_quality
from equalizer.tracking.workspace.workspace_models import WorkspaceModels

LENGTH_M = 0.06
LINES_HZ = np.arange(5.0, 35.001, 0.1)
OFF_GRID = np.linspace(0.0, 1.0, 21)


@dataclass(frozen=True)
class Workspaces:
    plants: ModuleType
    measuring: ModuleType

    def place_m(self, along):
        """along: 0 = centre, 1 = edge."""
        return (LENGTH_M * float(along), 0.01, 0.0)

    def plant(self, along, bend=0.0):
        return self.plants.omega_like(0.2 * along, 10.0 * along, bend)

    def identified(self, plant, seed, order=20, place_m=None, longer_horizons=(0, 2)) -> IdentifiedModel:
        settings = IdentificationSettings(order=order, draws=0, longer_horizons=longer_horizons)
        model = identify(self.measuring.swept(self.plants, plant, seed), settings).model
        return IdentifiedModel(
            model.A, model.B, model.C, model.D, model.sample_rate_hz, model.band_hz, model.input_unit,
            model.output_unit, model.input_channels, model.output_channels, place_m=place_m,
        )  # fmt: skip

    def models(self, along, seed, bend=0.0, order=20, longer_horizons=(0, 2)) -> WorkspaceModels:
        found = [
            self.identified(self.plant(x, bend), 100 * seed + round(50 * x), order, self.place_m(x), longer_horizons)
            for x in along
        ]
        return WorkspaceModels(tuple(found))

    def worst(self, at, bend=0.0) -> ResponseQuality:
        """at: from a place to ModelsAtPlace. Over all lines and 21 places."""
        found = [
            measure_quality(self.plant(x, bend).response(LINES_HZ) @ at(self.place_m(x)).compute_inverse(LINES_HZ))
            for x in OFF_GRID
        ]
        return ResponseQuality(
            max(each.flatness_db for each in found),
            max(each.coupling_db for each in found),
            max(each.axis_error_deg for each in found),
        )


def _measured_lines() -> ModuleType:
    path = Path(__file__).parents[2] / "identification" / "measured_lines.py"
    spec = importlib.util.spec_from_file_location("workspace_measured_lines", path)
    assert spec is not None and spec.loader is not None
    module = sys.modules["workspace_measured_lines"] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="session")
def workspaces(plants) -> Workspaces:
    return Workspaces(plants, _measured_lines())


@pytest.fixture(scope="session")
def three(workspaces) -> WorkspaceModels:
    return workspaces.models((0.0, 0.5, 1.0), seed=1, longer_horizons=(0,))


@pytest.fixture(scope="session")
def three_bent(workspaces, three) -> WorkspaceModels:
    """The ends of the bent path are those of the straight one."""
    middle = workspaces.models((0.5,), seed=1, bend=1.0).models
    return WorkspaceModels((three.models[0], *middle, three.models[2]))
