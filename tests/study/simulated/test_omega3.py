import numpy as np
import pytest

from study.devices.rig import POSITION, READING_SIZE
from study.devices.simulated import layout
from study.devices.simulated.compiled import solve_pose
from study.devices.simulated.inertia import fill_mass_matrix
from study.devices.simulated.omega3 import build_omega3


def masses_at(rig, place):
    """Inertia (3, 3) that a slow push at the handle meets."""
    jacobian, mass = np.empty((3, 3)), np.empty((5, 5))
    solve_pose(rig.parameters, np.array(place, float), np.empty(3), jacobian)
    fill_mass_matrix(rig.parameters, jacobian, mass)
    modes = rig.parameters[layout.MODE_DIRECTION :][: 3 * layout.HANDLE_MODES].reshape(-1, 3)
    weights = rig.parameters[layout.MODE_MASS :][: layout.HANDLE_MODES]
    carried = modes.T @ np.diag(weights) @ modes
    return mass[:3, :3] + carried + rig.parameters[layout.DRIVE_INERTIA] * jacobian.T @ jacobian


def test_it_says_what_it_is():
    info = build_omega3(4, hand=True).info
    assert (info.name, info.simulated, info.sample_rate_hz, info.max_force_n) == ("simulated omega.3", True, 1000, 12)
    assert "with a hand" in info.details and "seed 4" in info.details
    assert 0.2 < info.effective_mass_kg < 0.35


def test_the_stated_mass_is_met_in_every_direction_at_the_centre():
    rig = build_omega3(1, hand=False)
    assert masses_at(rig, [0, 0, 0]) == pytest.approx(rig.info.effective_mass_kg * np.eye(3), abs=1e-9)


def test_off_the_centre_mass_depends_on_direction_and_mirrored_places_on_the_same():
    rig = build_omega3(1, hand=False)
    aside = masses_at(rig, [0, 0.03, 0])
    ratio = np.divide(*np.linalg.eigvalsh(aside)[[2, 0]])
    assert 1.03 < ratio < 1.3
    flip = np.diag([1, -1, 1])
    assert masses_at(rig, [0, -0.03, 0]) == pytest.approx(flip @ aside @ flip, abs=1e-9)


def test_mirrored_test_directions_meet_the_same_mass_and_friction_in_the_upright_plane(direction):
    rig = build_omega3(1, hand=False)
    jacobian = np.empty((3, 3))
    for place in [(0, 0, 0), (0.02, 0, -0.03)]:
        solve_pose(rig.parameters, np.array(place, float), np.empty(3), jacobian)
        other = direction * [1, -1, 1]
        assert np.abs(jacobian @ direction).sum() == pytest.approx(np.abs(jacobian @ other).sum())
        mass = masses_at(rig, place)
        assert direction @ mass @ direction == pytest.approx(other @ mass @ other)


def test_a_hand_adds_its_mass_and_is_distinguished(bench):
    bare, held = (build_omega3(1, hand) for hand in (False, True))
    assert bare.info.effective_mass_kg == held.info.effective_mass_kg
    slow = [abs(bench.phasor(rig, 15.0, [0, 1, 0])[1]) for rig in (bare, held)]
    assert slow[1] < 0.85 * slow[0]


@pytest.mark.parametrize("hand", [False, True])
def test_it_rests_where_it_is_put(bench, hand):
    place = (0.02, -0.03, 0.04)
    rig = build_omega3(1, hand, place)
    before = rig.state.copy()
    rows = bench.play(rig, np.zeros((500, 3)))
    assert rig.state == pytest.approx(before, abs=1e-12)
    assert rows.shape == (500, READING_SIZE)
    assert rows[:, POSITION] == pytest.approx(np.tile(place, (500, 1)), abs=1.2e-5)


@pytest.mark.parametrize("place", [(0.08, 0, 0), (0.05, 0.05, 0.05), (float("nan"), 0, 0)])
def test_a_place_within_the_stops_is_refused(place):
    with pytest.raises(ValueError, match=r"place_m must be within 0\.075 m of the centre, not \("):
        build_omega3(1, hand=False, place_m=place)
