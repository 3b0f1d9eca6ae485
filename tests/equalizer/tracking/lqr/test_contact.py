import numpy as np
import pytest

from equalizer.tracking.lqr.changing_direction import play
from equalizer.tracking.lqr.contact import prepare_causal_start
from equalizer.tracking.lqr.lqr import compute_stored_gains, track
from equalizer.tracking.lqr.padding import compute_band_error
from equalizer.tracking.lqr.tracking_problem import TrackingError, TrackingWeights, make_tracking_problem

NORMALS = [np.eye(3)[0], np.array([1.0, 2.0, -2.0]) / 3, np.array([0.0, 0.6, 0.8])]


@pytest.fixture(scope="module")
def problem(device_model):
    return make_tracking_problem(device_model, TrackingWeights())


@pytest.fixture(scope="module")
def tap():
    time_s = np.arange(200) / 1000
    return np.exp(-time_s / 0.04) * np.sin(2 * np.pi * 22 * time_s)


@pytest.fixture(scope="module")
def start(problem, tap):
    return prepare_causal_start(problem, tap)


@pytest.mark.parametrize("normal", NORMALS)
def test_the_stated_error_is_what_the_device_misses(start, tap, plants, normal):
    wanted = np.outer(np.pad(tap, (0, 300)), normal)
    played = plants.omega_like().play(start.basis.compute_forces(normal))
    assert start.compute_error(normal) == pytest.approx(
        compute_band_error(wanted, played, 1000.0, (5.0, 35.0)), rel=1e-6
    )


@pytest.mark.parametrize("normal", NORMALS)
def test_the_early_error_is_that_of_forces_that_begin_300_ms_before(start, problem, tap, plants, normal):
    wanted = np.outer(np.pad(tap, (300, 300)), normal)
    played = plants.omega_like().play(track(compute_stored_gains(problem, 800), wanted).forces)
    assert start.compute_early_error(normal) == pytest.approx(
        compute_band_error(wanted, played, 1000.0, (5.0, 35.0)), rel=1e-6
    )


def test_an_unknown_initial_state_costs_little_and_not_nothing(start):
    for normal in NORMALS:
        assert start.compute_early_error(normal) < start.compute_error(normal) < 0.05
    assert max(start.compute_error(normal) for normal in NORMALS) <= start.worst_error < 0.05


def test_the_length_of_the_normal_does_not_matter_to_the_relative_error(start):
    assert start.compute_error(5 * NORMALS[1]) == pytest.approx(start.compute_error(NORMALS[1]), rel=1e-12)


def test_tick_by_tick_is_the_same_start(start):
    normal = NORMALS[1]
    live = play(start.live, np.tile(normal, (500, 1)))
    assert live.forces == pytest.approx(start.basis.compute_forces(normal), abs=1e-10)


def test_a_recording_without_energy_in_the_band_is_refused(problem):
    with pytest.raises(TrackingError, match="the recording has no content from 5 to 35 Hz"):
        prepare_causal_start(problem, np.zeros(100))


@pytest.mark.parametrize("normal", [np.zeros(3), np.ones(2), np.array([np.nan, 0, 0])])
def test_what_is_no_normal_is_refused(start, normal):
    with pytest.raises(TrackingError, match="a normal must be 3 finite numbers, not all zero"):
        start.compute_error(normal)
