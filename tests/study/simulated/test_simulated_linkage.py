"""The simulated device tells its linkage, and takes that of a calibration: its inertia then is the calibration's."""

from dataclasses import replace

import numpy as np
import pytest

from equalizer.linkage.calibration import estimate_local_inertia
from equalizer.linkage.grid import compute_difference_error, list_difference_positions, make_symmetric_grid
from study.devices.rig import POSITION
from study.devices.simulated.parameters import Linkage, Masses, Omega3Parameters
from study.devices.simulated.simulated_linkage import SimulatedLinkage, fit_linkage, make_simulated_linkage
from tests.equalizer.linkage.truth import calibration

OTHER = replace(
    Omega3Parameters(),
    linkage=Linkage(0.11, 0.18, 0.062, (90.0, 210.0, 330.0), 0.165),
    masses=replace(Masses(), handle_kg=0.19, upper_arm_kg_m2=2e-4, drive_kg_m2=1.05e-3),
)


def told(parameters=OTHER, spoil=lambda reading: reading):
    linkage = SimulatedLinkage(parameters, make_simulated_linkage().info)
    places = np.array(np.meshgrid(*3 * [[-0.04, -0.02, 0.0, 0.02, 0.04]], indexing="ij")).reshape(3, -1).T
    return calibration([spoil(linkage.compute_reading_at(place)) for place in places])


def test_its_jacobian_is_the_derivative_of_its_own_positions():
    linkage = make_simulated_linkage()
    for place in ([0.0, 0, 0], [0.03, -0.02, 0.04]):
        places = list_difference_positions(np.array(place))
        angles = np.array([linkage.compute_angles_at(each) for each in places])
        assert compute_difference_error(linkage.compute_reading_at(np.array(place)).jacobian, places, angles) < 1e-3


def test_its_inertia_at_the_centre_is_what_it_says_as_a_device():
    linkage = make_simulated_linkage()
    np.testing.assert_allclose(
        linkage.compute_reading_at(np.zeros(3)).inertia_kg, linkage.info.effective_mass_kg * np.eye(3), atol=1e-9
    )


@pytest.mark.parametrize("place_m", [(0.0, 0.0, 0.0), (0.01, -0.02, 0.01)])
def test_slopes_of_its_inertia_are_found_from_the_grid(place_m):
    """Oracle: differences of the linkage's own equations. The grid knows nothing between its positions."""
    linkage, place, step = make_simulated_linkage(), np.array(place_m), 1e-4
    grid = make_symmetric_grid(np.radians([90.0, 210.0, 330.0]), 0.05, 0.04)
    slopes = estimate_local_inertia(calibration([linkage.compute_reading_at(each) for each in grid]), place)[1]
    asides = step * np.eye(3)
    true = [
        (linkage.compute_reading_at(place + a).inertia_kg - linkage.compute_reading_at(place - a).inertia_kg)
        / (2 * step)
        for a in asides
    ]
    np.testing.assert_allclose(slopes, true, atol=0.02 * np.abs(true).max())


def test_in_the_stops_it_tells_nothing():
    linkage = make_simulated_linkage()
    assert (
        linkage.compute_reading_at(np.array([0.08, 0, 0])) is None
        and linkage.compute_angles_at(np.array([0.08, 0, 0])) is None
    )


def test_lengths_and_masses_of_another_device_are_found():
    found = fit_linkage(told()).parameters
    lengths = [
        [each.upper_arm_m, each.forearm_m, each.radius_m, each.depth_m] for each in (found.linkage, OTHER.linkage)
    ]
    np.testing.assert_allclose(lengths[0], lengths[1], rtol=1e-6)
    turning = [each.masses.upper_arm_kg_m2 + each.masses.drive_kg_m2 for each in (found, OTHER)]
    assert turning[0] == pytest.approx(turning[1], rel=1e-6)
    assert found.masses.handle_kg == pytest.approx(OTHER.masses.handle_kg)


@pytest.mark.parametrize("place_m", [(0.0, 0.0, 0.04), (0.0, 0.0, -0.04), (0.035, 0.02, 0.0)])
@pytest.mark.parametrize("axis", [0, 2])
def test_a_push_moves_it_as_the_calibrated_inertia_says(bench, place_m, axis):
    """Without friction, damping, loom and rocking base, a constant force moves the handle by F t² / 2 over the inertia
    there."""
    fitted = fit_linkage(told()).parameters
    bare = replace(
        fitted,
        drives=replace(fitted.drives, friction_n_m=0.0, damping_n_m_s=0.0, amplifier_hz=1e5),
        mount=replace(fitted.mount, masses_kg=(1e4, 1e4)),
        handle_modes=replace(fitted.handle_modes, frequencies_hz=6 * (400.0,)),
    )
    rig = bench.rig_of(bare, place_m=place_m)
    ticks, force_n = 60, 0.5
    moved = bench.play(rig, np.tile(force_n * np.eye(3)[axis], (ticks + 1, 1)))[:, POSITION]
    travelled = moved[ticks] - moved[0]
    mobility = np.linalg.inv(estimate_local_inertia(told(), np.array(place_m))[0])[:, axis]
    np.testing.assert_allclose(travelled, 0.5 * force_n * mobility * (ticks / 1000) ** 2, rtol=0.04, atol=1e-4)


def test_a_heavier_place_is_told_from_a_lighter_one(bench):
    """What the test above would not see if all places weighed the same."""
    masses = [estimate_local_inertia(told(), np.array(place))[0][2, 2] for place in ([0, 0, 0.04], [0.0, 0, -0.04])]
    assert masses[0] > 1.1 * masses[1]


def test_what_no_linkage_of_this_kind_has_is_refused():
    with pytest.raises(ValueError, match="inertia is .* off"):
        fit_linkage(told(spoil=lambda each: replace(each, inertia_kg=each.inertia_kg + np.diag([0.0, 0.0, 0.2]))))
    with pytest.raises(ValueError, match="handle would weigh"):
        fit_linkage(told(spoil=lambda each: replace(each, inertia_kg=0.1 * each.inertia_kg)))
    skewed = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.3], [0.0, 0.0, 1.0]])
    with pytest.raises(ValueError, match="Jacobian is .* off|120 degrees apart"):
        fit_linkage(told(spoil=lambda each: replace(each, jacobian=skewed @ each.jacobian)))
