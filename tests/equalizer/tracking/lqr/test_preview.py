import numpy as np
import pytest

from equalizer.tracking.lqr.lqr import compute_stored_gains, track
from equalizer.tracking.lqr.preview import compute_preview_loss, make_preview_tracker, track_stream
from equalizer.tracking.lqr.tracking_problem import TrackingError, TrackingWeights, make_tracking_problem


@pytest.fixture(scope="module")
def problems(device_model):
    return [
        make_tracking_problem(device_model, TrackingWeights(1e-2, low_frequency_weight=weight)) for weight in (0.0, 0.3)
    ]


def test_full_preview_is_the_finite_horizon_far_from_its_end(problem_of, difference):
    problem, wanted = problem_of(6, 0, 1e-2), np.random.default_rng(0).standard_normal((300, 3))
    right = track(compute_stored_gains(problem, 2000), np.pad(wanted, ((0, 1700), (0, 0)))).forces[:300]
    found = track_stream(make_preview_tracker(problem, 1500), wanted).forces
    assert difference(found, right) < 1e-9
    assert difference(track_stream(make_preview_tracker(problem, 3), wanted).forces, right) > 1e-2


def test_the_stated_loss_is_that_of_a_long_stream(problems, plants):
    wanted = plants.multisine(5.0, 35.0, 4.0, rms=1.0)
    for problem in problems:
        for preview in (50, 200):
            played = track_stream(make_preview_tracker(problem, preview), np.tile(wanted, (3, 1)))
            whole_period = slice(4000, 8000)
            missed = np.linalg.norm(played.predicted[whole_period] - wanted) / np.linalg.norm(wanted)
            assert compute_preview_loss(problem, preview).error == pytest.approx(missed, rel=0.1)


@pytest.mark.slow
def test_more_preview_loses_less(problems):
    losses = [compute_preview_loss(problems[0], preview).error for preview in (50, 100, 200, 400, 1000)]
    assert losses == sorted(losses, reverse=True)
    assert compute_preview_loss(problems[0], 6000).error == pytest.approx(
        compute_preview_loss(problems[0], 50).full_error, rel=0.01
    )


def test_a_low_frequency_weight_needs_less_preview(problems):
    plain, weighted = (compute_preview_loss(problem, 200) for problem in problems)
    assert weighted.error < 0.5 * plain.error


def test_but_costs_where_there_is_hardly_any_and_where_all_is_known(problems):
    plain, weighted = (compute_preview_loss(problem, 50) for problem in problems)
    assert weighted.error > 1.5 * plain.error
    assert plain.full_error < weighted.full_error < 0.01


def test_streamed_step_by_step_it_is_the_same(problem_of):
    problem, wanted = problem_of(6, 0, 1e-2, 1.0), np.random.default_rng(0).standard_normal((60, 3))
    tracker, x, forces = make_preview_tracker(problem, 20), np.zeros(9), []
    known = np.pad(wanted, ((0, 19), (0, 0)))
    for tick in range(60):
        force, x = tracker.step(x, known[tick : tick + 20])
        forces.append(force)
    streamed = track_stream(tracker, wanted)
    assert np.array(forces) == pytest.approx(streamed.forces, abs=1e-10)
    assert x == pytest.approx(streamed.final_state, abs=1e-10)


def test_stationary_gains_at_a_short_horizon_are_not_the_optimum(problem_of, difference):
    problem, wanted = problem_of(6, 0, 1e-2), np.random.default_rng(0).standard_normal((20, 3))
    finite = track(compute_stored_gains(problem, 20), wanted).forces
    assert difference(track_stream(make_preview_tracker(problem, 20), wanted).forces, finite) > 0.01


def test_a_preview_of_nothing_is_refused(problem_of):
    with pytest.raises(TrackingError, match="the preview is 0 samples"):
        make_preview_tracker(problem_of(4, 0), 0)
