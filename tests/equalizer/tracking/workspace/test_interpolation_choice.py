from dataclasses import replace

import numpy as np
import pytest

from equalizer.tracking.workspace.interpolation_choice import HeldOutPlace, choose_interpolation, make_held_out_place
from equalizer.tracking.workspace.workspace_models import WorkspaceError, WorkspaceModels

LINES = np.linspace(5, 35, 301)


def test_a_model_left_out_shows_that_moving_resonances_are_better_interpolated(three):
    choice = choose_interpolation(three)
    assert choice.interpolation == "modal"
    (check,) = choice.checks
    assert check.place_m == three.models[1].place_m
    assert check.modal_error < 0.1 < 0.2 < check.blended_error
    assert check.modal.coupling_db < check.blended.coupling_db - 10
    assert "resonances are interpolated (error at 1 place held out:" in choice.reason
    assert len(choice.find_models_at((0.02, 0.01, 0.0)).models) == 1


@pytest.mark.slow
def test_a_place_of_the_user_s_own_decides_where_one_is_given(workspaces, three_bent):
    truth = workspaces.plant(0.25, bend=1.0).response(LINES)
    choice = choose_interpolation(three_bent, [HeldOutPlace(workspaces.place_m(0.25), LINES, truth)])
    assert choice.interpolation == "modal"
    assert choice.checks[0].modal_error < 0.05


def test_without_a_model_between_others_forces_are_blended(three):
    ends = WorkspaceModels((three.models[0], three.models[2]))
    choice = choose_interpolation(ends)
    assert choice.interpolation == "blended forces"
    assert "no model lies between the others" in choice.reason
    assert choice.find_models_at((0.03, 0.01, 0.0)).weights == pytest.approx((0.5, 0.5))


def test_where_modes_do_not_match_forces_are_blended_and_the_reason_is_reported(three):
    first, middle, last = three.models
    flipped = replace(last, C=last.C[[1, 2, 0]], B=last.B[:, [2, 0, 1]])
    choice = choose_interpolation(WorkspaceModels((first, middle, flipped)))
    assert choice.interpolation == "blended forces"
    assert choice.reason.startswith("forces are blended, because models 2 (first) and 3 (second): ")


def test_modes_that_match_only_with_the_place_left_out_are_no_reason_to_trust_them(three, monkeypatch):
    from equalizer.tracking.workspace import interpolation_choice as module
    from equalizer.tracking.workspace.mode_matching import ModesDoNotMatchError

    real = module.build_modal_interpolation

    def only_whole(workspace):
        if len(workspace) < 3:
            raise ModesDoNotMatchError("too far apart")
        return real(workspace)

    monkeypatch.setattr(module, "build_modal_interpolation", only_whole)
    choice = choose_interpolation(three)
    assert choice.interpolation == "blended forces"
    assert "with a check place left out" in choice.reason
    assert choice.checks[0].modal is None


def test_a_check_where_blending_does_better_is_obeyed(workspaces, three):
    """A place that is the blend: the truth there is the inverse of the mean inverse."""
    from equalizer.tracking.workspace.blended_inverse import blend_at

    place = workspaces.place_m(0.3)
    truth = np.linalg.inv(blend_at(three, place).compute_inverse(LINES))
    choice = choose_interpolation(three, [HeldOutPlace(place, LINES, truth)])
    assert choice.interpolation == "blended forces"
    assert choice.reason.startswith("forces are blended (error at 1 place held out:")


def test_one_model_is_all_there_is(three):
    choice = choose_interpolation(WorkspaceModels(three.models[:1]))
    assert choice.reason == "there is only one model"


def test_a_held_out_place_that_is_a_model_s_own_is_refused(three):
    with pytest.raises(WorkspaceError, match="the place held out is that of model 2"):
        choose_interpolation(three, [make_held_out_place(three.models[1], (5.0, 35.0))])


def test_a_held_out_model_needs_a_place(three):
    with pytest.raises(ValueError, match="does not say where it was identified"):
        make_held_out_place(replace(three.models[0], place_m=None), (5.0, 35.0))


def test_a_single_model_without_a_place_is_not_at_the_origin(three):
    anywhere = WorkspaceModels((replace(three.models[0], place_m=None),))
    held_out = make_held_out_place(replace(three.models[1], place_m=(0.0, 0.0, 0.0)), (5.0, 35.0))
    assert choose_interpolation(anywhere, [held_out]).reason == "there is only one model"
