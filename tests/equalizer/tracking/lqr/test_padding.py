import numpy as np
import pytest

from equalizer.tracking.lqr.lqr import compute_stored_gains, track
from equalizer.tracking.lqr.padding import CAUSAL, Padding, compute_band_error, simulate_from_rest, track_padded
from equalizer.tracking.lqr.tracking_problem import TrackingError, TrackingWeights, make_tracking_problem


@pytest.fixture(scope="module")
def problem(device_model):
    return make_tracking_problem(device_model, TrackingWeights())


@pytest.fixture(scope="module")
def noise(plants):
    """It begins and ends at once, in the middle of its swing."""
    return plants.multisine(5.0, 35.0, 2.0)[:500]


def test_rows_of_forces_are_one_to_one_with_rows_of_the_trajectory(problem, noise):
    for padding in (Padding(), CAUSAL, Padding(0.0, 0.0), Padding(0.1, 0.2)):
        padded = track_padded(problem, noise, padding)
        before, after = padding.count_rows(1000.0)
        assert padded.forces.shape == (500, 3)
        assert padded.padded.forces.shape == (500 + before + after, 3)
        assert padded.padded.predicted[padded.rows].shape == (500, 3)


def test_no_padding_at_all_is_plain_tracking(problem, noise):
    bare = track_padded(problem, noise, Padding(0.0, 0.0))
    assert (bare.forces == track(compute_stored_gains(problem, 500), noise).forces).all()


def test_room_before_the_start_helps_where_it_is_played(problem, noise):
    assert (
        track_padded(problem, noise, Padding()).padded_error < 0.3 * track_padded(problem, noise, CAUSAL).padded_error
    )


def test_and_is_worse_than_none_where_only_the_rows_are_played(problem, noise):
    cut, causal = track_padded(problem, noise, Padding()), track_padded(problem, noise, CAUSAL)
    assert cut.cut_error > 3 * causal.cut_error
    assert causal.cut_error == pytest.approx(causal.padded_error, rel=1e-9)


def test_the_stated_errors_are_those_of_the_device(problem, noise, plants):
    padded = track_padded(problem, noise, Padding())
    whole = plants.omega_like().play(padded.padded.forces)[padded.rows]
    cut = plants.omega_like().play(padded.forces)
    assert padded.padded_error == pytest.approx(compute_band_error(noise, whole, 1000.0, (5.0, 35.0)), rel=1e-6)
    assert padded.cut_error == pytest.approx(compute_band_error(noise, cut, 1000.0, (5.0, 35.0)), rel=1e-6)


def test_room_after_the_end_lets_the_device_come_to_rest(problem, noise):
    still = np.zeros((300, 3))

    def ringing(padding) -> float:
        forces = track_padded(problem, noise, padding).padded.forces[:800]
        forces = np.vstack([forces, still[: 800 - len(forces)]])
        return float(np.linalg.norm(simulate_from_rest(problem, forces)[500:]))

    assert ringing(CAUSAL) < 0.2 * ringing(Padding(0.0, 0.0))


def test_a_light_force_weight_does_not_blow_up_slow_forces(device_model, noise):
    peaks = [
        np.abs(track_padded(make_tracking_problem(device_model, TrackingWeights(weight)), noise).forces).max()
        for weight in (1e-3, 1e-2)
    ]
    assert max(peaks) < 1.5


def test_nothing_wanted_in_the_band_has_no_error_to_state(problem):
    with pytest.raises(TrackingError, match="the reference has no content from 5 to 35 Hz"):
        track_padded(problem, np.zeros((100, 3)))


@pytest.mark.parametrize("name", ["before_s", "after_s"])
def test_a_padding_below_zero_is_refused(name):
    with pytest.raises(TrackingError, match=f"{name} is -0.1"):
        Padding(**{name: -0.1})
