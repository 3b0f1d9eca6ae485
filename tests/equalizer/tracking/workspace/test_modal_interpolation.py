from dataclasses import replace

import numpy as np
import pytest

from equalizer.plant.model_quality import summarise_quality
from equalizer.plant.model_response import compute_model_response
from equalizer.tracking.workspace.modal_interpolation import build_modal_interpolation
from equalizer.tracking.workspace.mode_matching import ModesDoNotMatchError
from equalizer.tracking.workspace.workspace_models import WorkspaceModels

LINES = np.linspace(5, 35, 301)


def relative(found, truth):
    return np.linalg.norm(found - truth, axis=(1, 2)).max() / np.sqrt((np.linalg.norm(truth, axis=(1, 2)) ** 2).mean())


def test_at_a_given_place_the_given_model_comes_back(three):
    for model in three.models:
        found = build_modal_interpolation(three).interpolate_at(model.place_m).models[0]
        assert relative(compute_model_response(found, LINES), compute_model_response(model, LINES)) < 0.01


def test_the_model_is_stable_small_and_says_what_it_is_made_of(three):
    at = build_modal_interpolation(three).interpolate_at((0.02, 0.01, 0.0))
    (model,) = at.models
    assert at.weights == (1.0,)
    assert at.remarks == ()
    assert model.spectral_radius < 1
    assert model.order <= 26
    assert model.place_m == (0.02, 0.01, 0.0)
    assert model.covariance is None
    expected = [f * (1 + 0.2 / 3) for f in (11.0, 13.2, 22.5, 31.0)]
    np.testing.assert_allclose(model.provenance["resonances_hz"], expected, rtol=0.01)


def test_the_order_in_which_models_are_given_does_not_matter(three):
    place = (0.041, 0.01, 0.0)
    one = build_modal_interpolation(three).interpolate_at(place).models[0]
    other = build_modal_interpolation(WorkspaceModels(three.models[::-1])).interpolate_at(place).models[0]
    np.testing.assert_allclose(
        compute_model_response(one, LINES), compute_model_response(other, LINES), rtol=1e-6, atol=1e-6
    )


def test_the_quality_and_the_delay_of_the_first_model_are_not_those_of_the_interpolated_one(three):
    first, *others = three.models
    delayed = replace(first, delay_samples=2.0, quality=summarise_quality(0.01, None, None))
    workspace = WorkspaceModels((delayed, *(replace(model, delay_samples=1.0) for model in others)))
    (model,) = build_modal_interpolation(workspace).interpolate_at((0.02, 0.01, 0.0)).models
    assert model.quality is None
    assert model.delay_samples == 1.0


def test_outside_the_nearest_place_is_used_and_reported(three):
    at = build_modal_interpolation(three).interpolate_at((0.09, 0.01, 0.0))
    assert "30.0 mm outside" in at.remarks[0]
    edge = build_modal_interpolation(three).interpolate_at((0.06, 0.01, 0.0)).models[0]
    np.testing.assert_allclose(
        compute_model_response(at.models[0], LINES), compute_model_response(edge, LINES), rtol=1e-4, atol=1e-4
    )


def test_devices_that_share_no_modes_are_refused_by_number(three):
    first, middle, last = three.models
    flipped = replace(last, C=last.C[[1, 2, 0]], B=last.B[:, [2, 0, 1]])
    with pytest.raises(ModesDoNotMatchError, match=r"models 2 \(first\) and 3 \(second\): "):
        build_modal_interpolation(WorkspaceModels((first, middle, flipped)))


def test_a_remainder_that_no_smooth_model_holds_is_reported(three, monkeypatch):
    from equalizer.tracking.workspace import modal_interpolation as module

    monkeypatch.setattr(module, "REAL_POLES_PER_OCTAVE", 0.1)
    assert (
        "the interpolated model has a fit error of up to"
        in build_modal_interpolation(three).interpolate_at((0.02, 0.01, 0.0)).remarks[0]
    )
