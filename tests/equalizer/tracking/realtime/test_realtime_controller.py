"""The numbers for a loop of others, against the trackers that they are of, played tick by tick."""

import numpy as np
import pytest

from equalizer.tracking.lqr.lqr import compute_stored_gains, track
from equalizer.tracking.lqr.tracking_problem import TrackingError
from equalizer.tracking.realtime.controller_cases import compute_controller_cases
from equalizer.tracking.realtime.realtime_controller import (
    RealtimeSettings,
    make_default_transient,
    make_realtime_controller,
)


@pytest.fixture(scope="module")
def controller(device_model):
    return make_realtime_controller(device_model, settings=RealtimeSettings(preview_s=0.05))


def test_a_stream_is_the_preview_tracker_one_sample_after_the_other(controller):
    wanted = np.random.default_rng(3).standard_normal((200, 3))
    bands, tracked = controller.simulate_stream(wanted)
    np.testing.assert_allclose(bands.total, wanted, atol=1e-12)
    known, x, preview = np.zeros((50, 3)), np.zeros(controller.problem.order), len(controller.tracker)
    assert preview == 50
    for row, arriving in enumerate(bands.middle):
        known = np.vstack([known[1:], arriving])
        force, x = controller.tracker.step(x, known)
        np.testing.assert_allclose(force, tracked.forces[row], atol=1e-12)


def test_a_stream_is_played_late_by_its_preview_less_a_sample(device_model):
    """In the middle of the band, where the causal split hardly touches what is wanted."""
    controller = make_realtime_controller(device_model, settings=RealtimeSettings(preview_s=0.2))
    time_s = np.arange(3000) / 1000
    wanted = np.zeros((3000, 3))
    wanted[:, 1] = np.sin(2 * np.pi * 15 * time_s)
    bands, tracked = controller.simulate_stream(wanted)
    late = 199
    answered, meant = tracked.predicted[1500:, 1], bands.middle[1500 - late : 3000 - late, 1]
    assert np.linalg.norm(answered - meant) < 0.05 * np.linalg.norm(meant)
    too_early = bands.middle[1500 - late + 10 : 3000 - late + 10, 1]
    assert np.linalg.norm(answered - too_early) > 0.5 * np.linalg.norm(meant)


def test_the_transient_is_the_best_forces_for_the_table_with_room_behind_it(controller, device_model):
    wanted = np.pad(make_default_transient(device_model), ((0, 300), (0, 0)))
    assert len(controller.transient) == len(wanted)
    cases = compute_controller_cases(controller, seed=5)
    best = track(compute_stored_gains(controller.problem, len(wanted)), wanted)
    np.testing.assert_allclose(np.einsum("kmc,c->km", controller.transient.g, np.eye(3).ravel())[0], best.forces[0])
    assert len(cases) > len(wanted)


def test_cases_stay_below_the_cap_and_come_near_to_it(controller):
    cases = compute_controller_cases(controller, seed=5)
    for forces in (cases.transient_forces, cases.stream_forces):
        assert 0.8 * controller.cap_n < np.linalg.norm(forces, axis=1).max() < controller.cap_n
    assert np.abs(cases.low).max() > 0.01 and np.abs(cases.high).max() > 0.01
    assert not cases.transient_forces[-40:].any()  # after the last row


def test_a_transient_of_nothing_is_refused_and_a_faint_one_is_not(device_model):
    faint = make_realtime_controller(
        device_model, 1e-9 * make_default_transient(device_model), RealtimeSettings(preview_s=0.05)
    )
    assert np.isfinite(compute_controller_cases(faint).rotations).all()
    silent = make_realtime_controller(device_model, np.zeros((40, 3)), RealtimeSettings(preview_s=0.05))
    with pytest.raises(TrackingError, match="the transient comes to no force"):
        compute_controller_cases(silent)


@pytest.mark.parametrize("wrong", [{"preview_s": -0.1}, {"preview_s": np.nan}, {"cap_n": 0.0}, {"cap_n": np.inf}])
def test_settings_that_no_loop_can_run_are_refused(wrong):
    with pytest.raises(TrackingError):
        RealtimeSettings(**wrong)
