"""Repeats on synthetic devices: friction, a place the model is not of, noise, the cap."""

import numpy as np
import pytest

from equalizer.plant.identified_model import IdentifiedModel
from equalizer.plant.model_response import compute_model_response
from equalizer.tracking.feedforward.band_pass import filter_to_band
from equalizer.tracking.learning.convergence import predict_convergence
from equalizer.tracking.learning.iteration import (
    IterationSettings,
    Verdict,
    estimate_repeat_noise,
    estimate_rest_noise,
    find_largest_share,
    rms,
    start_iteration,
    update_forces,
)
from equalizer.tracking.lqr.lqr import compute_stored_gains, track
from equalizer.tracking.lqr.tracking_problem import TrackingWeights, make_tracking_problem
from tests.slow_instances import slow_rows

RATE_HZ, BAND_HZ, AROUND = 1000.0, (5.0, 35.0), 300
SEEDS = range(5)
LINES_HZ = np.arange(5.0, 35.1, 0.25)


@pytest.fixture(scope="module")
def model(plants) -> IdentifiedModel:
    plant, channels = plants.omega_like(), (("fx", "fy", "fz"), ("ax", "ay", "az"))
    return IdentifiedModel(plant.A, plant.B, plant.C, np.zeros((3, 3)), RATE_HZ, BAND_HZ, "N", "m/s^2", *channels)


@pytest.fixture(scope="module")
def wanted() -> np.ndarray:
    """Two seconds of noise in the band, 1.8 m/s² per axis, faded, with time around."""
    noise = filter_to_band(np.random.default_rng(7).standard_normal((6000, 3)), RATE_HZ, BAND_HZ)[2000:4000]
    fade = np.clip(np.minimum(np.arange(2000), np.arange(2000)[::-1]) / 100, 0, 1)[:, None]
    rows = np.zeros((2000 + 2 * AROUND, 3))
    rows[AROUND:-AROUND] = 1.8 * noise / noise.std(axis=0) * (0.5 - 0.5 * np.cos(np.pi * fade))
    return filter_to_band(rows, RATE_HZ, BAND_HZ)


@pytest.fixture(scope="module")
def invert(model, wanted):
    gains = compute_stored_gains(make_tracking_problem(model, TrackingWeights(weight=1e-3)), len(wanted))
    return lambda rows: track(gains, rows).forces


@pytest.fixture
def repetition(wanted, invert) -> IterationSettings:
    return IterationSettings(wanted, invert, RATE_HZ, BAND_HZ, noise_floor=None)


def error(device, forces, wanted) -> float:
    return rms(filter_to_band(device.play(forces) - wanted, RATE_HZ, BAND_HZ)) / rms(wanted)


def repeated(device, repetition, repeats, seed):
    """Plays once and at most `find_repeats` times more."""
    state = start_iteration(repetition)
    for play in range(repeats + 1):
        if state.verdict is not Verdict.CONTINUE:
            break
        state = update_forces(state, device.measured(state.forces, seed=1000 * seed + play))
    return state


@pytest.mark.slow
@pytest.mark.parametrize(("friction_n", "first_at_least"), [(0.1, 0.1), (0.3, 0.3)])
def test_friction_is_learnt_within_ten_repeats(rubbing, plants, repetition, wanted, friction_n, first_at_least):
    device = rubbing.rubbing(plants.modes_of(), friction_n)
    rest = [estimate_rest_noise(device.measured(np.zeros((1000, 3)), seed=seed + 77), repetition) for seed in SEEDS]
    states = [
        repeated(device, IterationSettings(wanted, repetition.invert, RATE_HZ, BAND_HZ, noise_floor=floor), 10, seed)
        for seed, floor in zip(SEEDS, rest, strict=True)
    ]
    errors = [error(device, state.best_forces, wanted) for state in states]
    assert error(device, states[0].settings.invert(wanted), wanted) > first_at_least
    assert np.median(errors) < 0.02
    assert max(errors) < 0.02


@pytest.mark.parametrize(
    ("friction_n", "floor_from"),
    [(0.005, "rest"), *slow_rows((0.0, "repeats"), (0.002, "repeats"), (0.01, "repeats"))],
)
def test_a_good_first_shot_is_not_made_worse(rubbing, plants, repetition, wanted, friction_n, floor_from):
    device = rubbing.rubbing(plants.modes_of(0.003, 0.2), friction_n)
    first = error(device, repetition.invert(wanted), wanted)
    known = (
        estimate_rest_noise(device.measured(np.zeros((1000, 3)), seed=5), repetition) if floor_from == "rest" else None
    )
    same = IterationSettings(wanted, repetition.invert, RATE_HZ, BAND_HZ, noise_floor=known)
    errors = [error(device, repeated(device, same, 10, seed).best_forces, wanted) for seed in SEEDS]
    assert max(errors) <= 1.05 * first


def test_a_fixed_gain_would_make_a_good_first_shot_worse(rubbing, plants, repetition, wanted):
    device = rubbing.rubbing(plants.modes_of(), 0.0)
    forces = repetition.invert(wanted)
    first = error(device, forces, wanted)
    missing = repetition.extract_band(wanted - device.measured(forces, seed=1))
    assert error(device, forces + repetition.invert(missing), wanted) > 1.05 * first


def test_where_only_noise_is_left_nothing_is_corrected(rubbing, plants, repetition):
    device = rubbing.rubbing(plants.modes_of(), 0.0)
    for seed in SEEDS:
        state = repeated(device, repetition, 10, seed)
        assert state.verdict is Verdict.AT_FLOOR
        assert state.gains == ()


def test_the_floor_from_two_plays_is_the_sensors(rubbing, plants, repetition, wanted):
    device = rubbing.rubbing(plants.modes_of(), 0.1)
    forces = repetition.invert(wanted)
    plays = np.stack([device.measured(forces, seed) for seed in range(2)])
    noise = filter_to_band(np.random.default_rng(1).standard_normal((20000, 3)) * plants.SENSOR_RMS, RATE_HZ, BAND_HZ)
    assert estimate_repeat_noise(plays, repetition) == pytest.approx(rms(noise), rel=0.15)


def test_at_a_place_shifted_by_a_fifth_divergence_is_predicted(plants, model):
    inverse = np.linalg.inv(compute_model_response(model, LINES_HZ))
    here = predict_convergence(inverse, plants.omega_like().response(LINES_HZ), LINES_HZ, BAND_HZ)
    there = predict_convergence(inverse, plants.omega_like(0.2, 10.0).response(LINES_HZ), LINES_HZ, BAND_HZ)
    assert here.converges
    assert here.safe_beta == pytest.approx(2, abs=1e-6)
    assert not there.converges
    assert 10 < there.worst_hz < 35


def test_the_safe_gain_is_where_errors_begin_to_grow(plants, model):
    inverse = np.linalg.inv(compute_model_response(model, LINES_HZ))
    device = plants.omega_like(0.1, 5.0).response(LINES_HZ)
    safe = predict_convergence(inverse, device, LINES_HZ, BAND_HZ).safe_beta
    assert 0 < safe < 2
    assert predict_convergence(inverse, device, LINES_HZ, BAND_HZ, 0.999 * safe).converges
    assert not predict_convergence(inverse, device, LINES_HZ, BAND_HZ, 1.001 * safe).converges


@pytest.mark.parametrize("singular", [0, 1], ids=["learned inverse", "device"])
def test_no_gain_is_safe_where_one_direction_is_not_corrected_or_does_not_move(plants, model, singular):
    inverse, device = np.linalg.inv(compute_model_response(model, LINES_HZ)), plants.omega_like().response(LINES_HZ)
    (inverse, device)[singular][:, 1] = (inverse, device)[singular][:, 0]
    found = predict_convergence(inverse, device, LINES_HZ, BAND_HZ)
    assert found.safe_beta == 0
    assert not found.converges


def test_of_several_possible_devices_the_worst_counts(plants, model):
    inverse = np.linalg.inv(compute_model_response(model, LINES_HZ))
    one, other = (plants.omega_like(shift).response(LINES_HZ) for shift in (0.0, 0.1))
    both = predict_convergence(inverse, np.stack([one, other]), LINES_HZ, BAND_HZ)
    assert both.safe_beta == predict_convergence(inverse, other, LINES_HZ, BAND_HZ).safe_beta


def test_responses_that_do_not_belong_together_are_refused(plants, model):
    inverse = np.linalg.inv(compute_model_response(model, LINES_HZ))
    with pytest.raises(ValueError, match="as many forces as responses"):
        predict_convergence(inverse, inverse[:5], LINES_HZ, BAND_HZ)
    with pytest.raises(ValueError, match="no line lies in the band"):
        predict_convergence(inverse, inverse, LINES_HZ, (80.0, 90.0))


@pytest.mark.slow
def test_at_a_shifted_place_a_smaller_gain_gets_there(rubbing, plants, repetition, wanted):
    device = rubbing.rubbing(plants.modes_of(0.2, 10.0), 0.0)
    careful = IterationSettings(wanted, repetition.invert, RATE_HZ, BAND_HZ, first_gain=0.7)
    first = error(device, repetition.invert(wanted), wanted)
    errors = [error(device, repeated(device, careful, 10, seed).best_forces, wanted) for seed in range(3)]
    assert first > 0.2
    assert max(errors) < 0.05


def test_a_correction_that_is_always_wrong_ends_as_diverging(plants, repetition, wanted):
    plant = plants.omega_like()
    wrong = IterationSettings(wanted, lambda rows: -2 * repetition.invert(rows), RATE_HZ, BAND_HZ, noise_floor=0.01)
    state = start_iteration(wrong, initial_forces=0.5 * repetition.invert(wanted))
    for play in range(10):
        if state.verdict is not Verdict.CONTINUE:
            break
        state = update_forces(state, plant.measured(state.forces, play))
    assert state.verdict is Verdict.DIVERGING
    np.testing.assert_array_equal(state.forces, 0.5 * repetition.invert(wanted))


def test_corrections_stay_under_the_cap_and_say_so(rubbing, plants, repetition, wanted):
    device = rubbing.rubbing(plants.modes_of(), 0.3)
    peak = float(np.linalg.norm(repetition.invert(wanted), axis=1).max())
    capped = IterationSettings(wanted, repetition.invert, RATE_HZ, BAND_HZ, cap_n=1.02 * peak)
    state = repeated(device, capped, 5, seed=1)
    assert np.linalg.norm(state.best_forces, axis=1).max() <= 1.02 * peak * (1 + 1e-9)
    assert "were scaled down" in state.remark
    assert f"within {1.02 * peak:g} N" in state.remark


def test_corrections_stay_below_the_slew_limit_and_say_so(rubbing, plants, repetition, wanted):
    device, first = rubbing.rubbing(plants.modes_of(), 0.3), repetition.invert(wanted)
    slew = 1.1 * steepest(first)
    state = start_iteration(
        IterationSettings(wanted, repetition.invert, RATE_HZ, BAND_HZ, noise_floor=0.02, slew_n_per_s=slew)
    )
    found = []
    while state.verdict is Verdict.CONTINUE and len(found) < 5:
        state = update_forces(state, device.measured(state.forces, seed=len(found)))
        found.append(steepest(state.forces))
    assert max(found) <= slew * (1 + 1e-9)
    assert min(state.scales) < 1
    assert state.remark.endswith(f"to keep its change within {slew:.4g} N/s")


def test_a_correction_that_no_slew_limit_leaves_room_for_ends_with_the_best_forces(plants, repetition, wanted):
    first = repetition.invert(wanted)
    tight = IterationSettings(
        wanted, repetition.invert, RATE_HZ, BAND_HZ, noise_floor=1e-3, slew_n_per_s=0.5 * steepest(first)
    )
    state = update_forces(start_iteration(tight, first), 0.8 * wanted)
    assert state.verdict is Verdict.BEST_KEPT
    np.testing.assert_array_equal(state.forces, first)


def test_at_the_ends_of_the_record_no_impulse_is_built_up(repetition, wanted):
    """The device answers nothing there, as a handle that sticks."""
    jumps = np.zeros_like(wanted)
    jumps[:5], jumps[-5:] = 20.0, -20.0
    known = IterationSettings(wanted, lambda rows: repetition.invert(rows) + jumps, RATE_HZ, BAND_HZ, noise_floor=1e-3)
    first = repetition.invert(wanted)
    state = start_iteration(known, first)
    for _ in range(4):
        state = update_forces(state, 0.5 * wanted)
    assert state.gains
    np.testing.assert_array_equal(state.forces[[0, -1]], first[[0, -1]])
    assert steepest(state.forces) < 0.5 * RATE_HZ * np.linalg.norm(jumps[0])


def steepest(forces) -> float:
    return float(np.linalg.norm(np.diff(forces, axis=0, prepend=0.0), axis=1).max()) * RATE_HZ


def test_what_fits_under_a_cap_is_not_above_it_by_rounding():
    for seed in range(200):
        forces, correction = np.random.default_rng(seed).standard_normal((2, 20, 3))
        cap = 1.01 * float(np.linalg.norm(forces, axis=1).max())
        fitted = forces + find_largest_share(forces, 10 * correction, cap) * 10 * correction
        assert np.linalg.norm(fitted, axis=1).max() <= cap


def test_the_share_that_fits_ends_at_the_cap():
    forces, correction = np.array([[1.0, 0.0], [0.0, 0.5]]), np.array([[2.0, 1.0], [0.0, 0.1]])
    share = find_largest_share(forces, correction, 2.0)
    assert np.linalg.norm(forces + share * correction, axis=1).max() == pytest.approx(2.0)
    assert find_largest_share(forces, correction, 10.0) == 1.0


def test_first_forces_above_the_cap_are_refused(repetition, wanted):
    with pytest.raises(ValueError, match=r"the first forces reach .* N, but the cap is 0.1 N"):
        start_iteration(IterationSettings(wanted, repetition.invert, RATE_HZ, BAND_HZ, cap_n=0.1))


def test_what_has_nothing_in_the_band_is_refused(repetition, wanted):
    with pytest.raises(ValueError, match="no content in the band of 5 to 35 Hz"):
        start_iteration(IterationSettings(0 * wanted, repetition.invert, RATE_HZ, BAND_HZ))


def test_a_measurement_that_does_not_fit_is_refused(repetition, wanted):
    state = start_iteration(repetition)
    with pytest.raises(ValueError, match="must be"):
        update_forces(state, wanted[:-1])
    with pytest.raises(ValueError, match="not finite"):
        update_forces(state, wanted * np.nan)


def test_an_iteration_that_is_over_takes_nothing_more(plants, repetition, wanted):
    state = repeated(plants.omega_like(), repetition, 10, seed=1)
    with pytest.raises(ValueError, match="this iteration is over"):
        update_forces(state, wanted)


def test_a_sharp_tone_in_the_band_passes_whole_and_one_outside_not():
    time_s = np.arange(4000) / RATE_HZ
    window = np.hanning(4000)[:, None]
    inside, outside = (np.sin(2 * np.pi * hz * time_s)[:, None] * window for hz in (15.0, 60.0))
    np.testing.assert_allclose(filter_to_band(inside, RATE_HZ, BAND_HZ), inside, atol=1e-3)
    assert rms(filter_to_band(outside, RATE_HZ, BAND_HZ)) < 1e-4


def test_rows_that_are_not_judged_do_not_hold_up_a_verdict(plants, repetition, wanted):
    plant, rows = plants.omega_like(), len(wanted) - AROUND
    spoilt = np.zeros_like(wanted)
    spoilt[rows:] = 0.5 * np.sin(2 * np.pi * 15 * np.arange(AROUND) / RATE_HZ)[:, None]
    states = []
    for judged in (None, (0, rows - 100)):
        state = start_iteration(
            IterationSettings(wanted, repetition.invert, RATE_HZ, BAND_HZ, noise_floor=0.02, judged_rows=judged)
        )
        states.append(update_forces(state, plant.measured(state.forces, 3) + spoilt))
    assert [state.verdict for state in states] == [Verdict.CONTINUE, Verdict.AT_FLOOR]
