"""A controller of a synthetic device, exported."""

import pytest

from study.workflows.equalizer.controller.export_controller import ControllerPlan, export_controller
from tests.study.workflows.equalizer.controller.build import write_model


@pytest.fixture(scope="module")
def exported(tmp_path_factory):
    folder = tmp_path_factory.mktemp("controller")
    return export_controller(ControllerPlan(write_model(folder / "model.h5"), folder / "out"))
