from dataclasses import replace

import numpy as np
import pytest

from equalizer.plant.identified_model import IdentifiedModel
from equalizer.tracking.workspace.blended_inverse import blend_at
from equalizer.tracking.workspace.workspace_models import WorkspaceError, WorkspaceModels


@pytest.fixture
def model():
    return IdentifiedModel(
        0.5 * np.eye(2), np.eye(2), np.eye(2), np.zeros((2, 2)), 1000.0, (5.0, 35.0), "N", "m/s^2",
        ("fx", "fy"), ("ax", "ay"), place_m=(0.0, 0.0, 0.0),
    )  # fmt: skip


def moved(model, x, **changes):
    return replace(model, place_m=(x, 0.0, 0.0), **changes)


def test_the_band_is_what_all_models_cover(model):
    assert WorkspaceModels((model, moved(model, 0.02, band_hz=(6.0, 50.0)))).band_hz == (6.0, 35.0)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"sample_rate_hz": 2000.0}, "model 2 has the sample rate 2000.0, but the first has 1000.0"),
        ({"output_channels": ("ay", "ax")}, "output channels"),
        ({"input_channels": ("fy", "fx")}, "input channels"),
        ({"band_hz": (40.0, 80.0)}, "no band in common"),
        ({"A": 1.1 * np.eye(2)}, "model 2 is not stable"),
        ({"place_m": None}, "number 2 does not say where it was identified"),
        ({"place_m": (0.0, 0.0, 0.00005)}, "models 1 and 2 were identified at the same place"),
    ],
)
def test_models_that_do_not_go_together_are_refused(model, changes, words):
    with pytest.raises(WorkspaceError, match=words):
        WorkspaceModels((model, replace(moved(model, 0.02), **changes)))


def test_no_model_is_refused():
    with pytest.raises(WorkspaceError, match="no model was given"):
        WorkspaceModels(())


def test_a_single_model_without_a_place_serves_everywhere_and_that_is_said(model):
    at = blend_at(WorkspaceModels((replace(model, place_m=None),)), (0.03, 0.0, 0.0))
    assert at.weights == (1.0,)
    assert at.remarks == ("the only model does not say where it was identified",)


def test_forces_are_blended_not_models(model):
    """Half of what each model asks for; the mean of the models would ask for something else."""
    strong = moved(model, 0.02, C=3 * np.eye(2))
    at = blend_at(WorkspaceModels((model, strong)), (0.01, 0.0, 0.0))
    asked = at.compute_inverse(np.array([10.0]), weight=0.0)[0]
    parts = [
        blend_at(WorkspaceModels((each,)), (0, 0, 0)).compute_inverse(np.array([10.0]), 0.0)[0] for each in at.models
    ]
    np.testing.assert_allclose(asked, (parts[0] + parts[1]) / 2)
    np.testing.assert_allclose(at.compute_forces(lambda each: each.C), 2 * np.eye(2))


def test_a_model_that_does_not_count_is_not_asked(model):
    at = blend_at(WorkspaceModels((model, moved(model, 0.02))), (0.0, 0.0, 0.0))
    asked = []
    at.compute_forces(lambda each: asked.append(each) or np.zeros(1))
    assert asked == [model]
