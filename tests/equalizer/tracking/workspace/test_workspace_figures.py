"""What is reached between places, on the synthetic device whose resonances move by a fifth and whose shapes turn."""

import numpy as np
import pytest

from equalizer.tracking.workspace.blended_inverse import blend_at
from equalizer.tracking.workspace.modal_interpolation import build_modal_interpolation
from equalizer.tracking.workspace.models_at_place import ModelsAtPlace

SEEDS = range(1, 6)


def test_between_three_models_the_worst_place_is_flat_and_uncoupled(workspaces, three):
    worst = workspaces.worst(build_modal_interpolation(three).interpolate_at)
    assert worst.flatness_db <= 0.2
    assert worst.coupling_db <= -36


@pytest.mark.slow
def test_also_where_modes_do_not_change_linearly_along_the_way(workspaces, three_bent):
    worst = workspaces.worst(build_modal_interpolation(three_bent).interpolate_at, bend=1.0)
    assert worst.flatness_db <= 0.3
    assert worst.coupling_db <= -32


@pytest.mark.slow
def test_blended_forces_are_a_safe_second_and_the_model_of_the_centre_is_bad(workspaces, three):
    blended = workspaces.worst(lambda place_m: blend_at(three, place_m))
    centre = workspaces.worst(lambda place_m: ModelsAtPlace(place_m, three.models[:1], (1.0,)))
    assert (blended.flatness_db, blended.coupling_db) < (3.0, -15.0)
    assert centre.flatness_db > 2 * blended.flatness_db
    assert centre.coupling_db > blended.coupling_db + 10


@pytest.mark.slow
@pytest.mark.parametrize("order", [20, 26])
@pytest.mark.timeout(900)
def test_figures_of_the_workspace_over_five_seeds(workspaces, order):
    """Median and worst of 2026-11, either order alike: three 0.04, 0.05 dB and -49, -48 dB; bent 0.16, 0.16 dB and
    -36.4, -36.2 dB; five 0.05, 0.06 dB and -49, -48 dB."""
    found = {"three": [], "three, bent": [], "five": []}
    for seed in SEEDS:
        five = workspaces.models((0.0, 0.25, 0.5, 0.75, 1.0), seed, order=order)
        three = type(five)(five.models[::2])
        middle = workspaces.models((0.5,), seed, bend=1.0, order=order).models
        bent = type(five)((five.models[0], *middle, five.models[4]))
        found["three"].append(workspaces.worst(build_modal_interpolation(three).interpolate_at))
        found["three, bent"].append(workspaces.worst(build_modal_interpolation(bent).interpolate_at, bend=1.0))
        found["five"].append(workspaces.worst(build_modal_interpolation(five).interpolate_at))
    for name, rows in found.items():
        numbers = np.array([(row.flatness_db, row.coupling_db) for row in rows])
        flat, coupled = (0.3, -35) if name == "five" else (0.5, -28)
        assert numbers[:, 0].max() <= flat, (name, numbers)
        assert numbers[:, 1].max() <= coupled, (name, numbers)
