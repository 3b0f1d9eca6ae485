"""The force balance beside a given model, and what a gain on held-out data is worth."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from analysis.diagnosis.confirm import decide_with_model as beside_given
from analysis.diagnosis.confirm.balance_with_model import find_balances_with_model
from analysis.diagnosis.confirm.decide_with_model import find_objection
from analysis.diagnosis.confirm.held_out_gain import estimate_held_out_gain, explains_half, predicts_motion
from analysis.diagnosis.errors.tuning import make_tuning
from analysis.diagnosis.search.time_budget import grant_time
from equalizer.plant.mechanical_model import MechanicalModel, Tolerance
from equalizer.signals.recording import Recording
from equalizer.signals.signal import Signal
from tests.diagnosed import device

RATE_HZ, MASS, DAMPING, LEVEL = 200.0, 2.0, 5.0, 3.0
GIVEN = MechanicalModel(
    "slide", "position", np.eye(1) * MASS, np.eye(1) * DAMPING, np.zeros((1, 1)), np.eye(1), np.eye(1),
    tolerance=Tolerance(0.05, 0.5, 1.0),
)  # fmt: skip


def record_friction(level, mass=MASS):
    seconds = np.arange(6000) / RATE_HZ
    lines = [(0.05, 2 * np.pi * 0.31), (0.02, 2 * np.pi * 0.83), (0.008, 2 * np.pi * 1.7)]
    x = sum(size * np.sin(w * seconds) for size, w in lines)
    v = sum(size * w * np.cos(w * seconds) for size, w in lines)
    a = sum(-size * w**2 * np.sin(w * seconds) for size, w in lines)
    noise = np.random.default_rng(3).normal(0, [1e-6, 0.01], (len(x), 2))
    force = mass * a + DAMPING * v + level * np.tanh(v / 1e-3)
    return Recording(
        "slide",
        Signal((force + noise[:, 1])[:, None], RATE_HZ, "force", "N", ("force",)),
        Signal((x + noise[:, 0])[:, None], RATE_HZ, "position", "m", ("x",)),
        meta={"imposed": True},
    )


@pytest.fixture(scope="module")
def friction_balance():
    return find_balances_with_model((record_friction(LEVEL),), GIVEN, frozenset(), grant_time)[0]


@pytest.mark.slow
def test_what_a_given_model_lacks_is_named_by_the_balance(friction_balance):
    law = friction_balance.named[0]
    assert law.law.effect == "coulomb_friction"
    assert law.values["level"] == pytest.approx(LEVEL, rel=0.1)
    assert law.gain_low > 0.5


@pytest.mark.parametrize("mass", [MASS, MASS + 0.05], ids=["as calibrated", "a standard deviation off"])
def test_a_device_within_its_calibration_lacks_nothing(mass):
    (balance,) = find_balances_with_model((record_friction(0.0, mass),), GIVEN, frozenset(), grant_time)
    assert balance.named == ()
    assert balance.linear_error < 0.05


def test_a_calibrated_number_does_not_take_friction_on_itself(friction_balance):
    """Fitted freely, damping would hold part of it; its prior keeps it within a few standard deviations."""
    regression = friction_balance.search.regression
    deviations = regression.fit_weights(regression.select_columns(()))[1 : regression.base_column_count - 1]
    assert np.abs(deviations).max() < 10
    loose = replace(regression, prior=None)
    assert (
        loose.cross_validate(loose.select_columns(())).sum()
        <= regression.cross_validate(regression.select_columns(())).sum()
    )


def make_candidate(residuals, name="coulomb_friction", deviations=(0.0,)):
    claim = SimpleNamespace(effect=SimpleNamespace(name=name, simpler=()), spread="one", sites=(0,))
    hypothesis = SimpleNamespace(claims=(claim,))
    fitted = SimpleNamespace(residuals=(residuals,), hypothesis=hypothesis, deviations=np.array(deviations))
    return SimpleNamespace(fitted=fitted, newest=name)


MEASURE = SimpleNamespace(
    records=(SimpleNamespace(test=np.ones(1600, dtype=bool)),), unit=np.array([1.0, 1.0]), noise=np.full(2, 0.1)
)
NOISE = np.random.default_rng(5).normal(size=(1600, 2))


def test_a_gain_is_the_share_of_the_error_power_that_goes():
    found = estimate_held_out_gain(MEASURE, make_candidate(NOISE), make_candidate(0.5 * NOISE))
    assert (found.gain, found.low, found.high) == pytest.approx((0.75, 0.75, 0.75))


def test_a_channel_of_noise_alone_does_not_lower_the_gain():
    """An effect on one axis, in a device whose other axes are predicted down to their noise."""
    without, with_effect = (np.column_stack([scale * NOISE[:, 0], 0.1 * NOISE[:, 1]]) for scale in (1.0, 0.5))
    found = estimate_held_out_gain(MEASURE, make_candidate(without), make_candidate(with_effect))
    assert (found.gain, found.low, found.high) == pytest.approx((0.75, 0.75, 0.75))
    worse = np.column_stack([0.5 * NOISE[:, 0], NOISE[:, 1]])
    assert estimate_held_out_gain(MEASURE, make_candidate(without), make_candidate(worse)).gain < -40


def test_a_random_difference_has_a_gain_interval_around_zero():
    other = np.random.default_rng(6).normal(size=(1600, 2))
    found = estimate_held_out_gain(MEASURE, make_candidate(NOISE), make_candidate(other))
    assert found.low < 0 < found.high


def test_where_no_sample_is_held_out_there_is_no_gain():
    nothing = SimpleNamespace(records=(SimpleNamespace(test=np.zeros(1600, dtype=bool)),))
    assert estimate_held_out_gain(nothing, make_candidate(NOISE), make_candidate(0.5 * NOISE)) is None


POSITIONS = SimpleNamespace(response=SimpleNamespace(quantities=("position", "position")), position=None)


@pytest.mark.parametrize(
    ("name", "left", "something"),
    [("free simulation", 1.01, False), ("free simulation", 0.9, True), ("predicted force", 1.01, True)],
)
def test_a_model_that_leaves_as_much_of_a_motion_as_its_mean_predicts_nothing(name, left, something):
    record = SimpleNamespace(test=np.ones(1600, dtype=bool), measured=3.0 + 2.0 * NOISE, recording=POSITIONS)
    measure = SimpleNamespace(name=name, records=(record,), unit=np.array([2.0, 2.0]), noise=np.full(2, 0.1))
    assert predicts_motion(measure, make_candidate(left * NOISE)) == something


@pytest.mark.parametrize(("left", "idle", "something"), [(0.5, 1e-3, True), (0.5, 0.0, True), (1.5, 1e-3, False)])
def test_an_idle_channel_does_not_say_whether_a_model_predicts_something(left, idle, something):
    record = SimpleNamespace(test=np.ones(1600, dtype=bool), measured=NOISE * (1.0, idle), recording=POSITIONS)
    measure = SimpleNamespace(name="free simulation", records=(record,), unit=np.ones(2), noise=np.full(2, 0.01))
    assert predicts_motion(measure, make_candidate(NOISE * (left, 0.02))) == something


@pytest.mark.parametrize("name", ["free simulation", "predicted force"])
@pytest.mark.parametrize(
    ("left", "noise", "half"), [(0.69, 0.01, True), (0.72, 0.01, False), (0.72, 0.4, True), (0.8, 0.4, False)]
)
def test_a_name_needs_a_model_that_explains_half_of_what_is_no_noise(name, left, noise, half):
    record = SimpleNamespace(test=np.ones(1600, dtype=bool), measured=3.0 + NOISE, recording=POSITIONS)
    measure = SimpleNamespace(name=name, records=(record,), unit=np.ones(2), noise=np.full(2, noise))
    assert explains_half(measure, make_candidate(left * NOISE)) == half


def make_search_result(after, rival=None):
    tuning = make_tuning(device(1), ("fx",))
    context = SimpleNamespace(full_measure=MEASURE, tuning=tuning, with_test_score=lambda each: each)
    rounds = ((after, *(() if rival is None else (rival,))),)
    found = SimpleNamespace(steps=(after,), plain=make_candidate(NOISE), after=after, rounds=rounds)
    return SimpleNamespace(context=context, found=found)


@pytest.mark.parametrize(
    ("after", "rival", "said"),
    [
        (make_candidate(0.3 * NOISE), None, ""),
        (make_candidate(0.3 * NOISE), make_candidate(0.6 * NOISE, "backlash"), ""),
        (make_candidate(0.3 * NOISE), make_candidate(0.3 * NOISE, "backlash"), "cannot distinguish it from backlash"),
        (make_candidate(0.95 * NOISE), None, "and 30 % are required"),
        (make_candidate(0.8 * NOISE), None, "the force balance does not confirm it"),
        (make_candidate(1.2 * NOISE), None, "variation between stretches"),
        (make_candidate(0.3 * NOISE, deviations=(4.0,)), None, "to the limit of its tolerance"),
    ],
)
def test_a_rival_or_a_poor_prediction_is_an_objection_to_a_name(monkeypatch, after, rival, said):
    monkeypatch.setattr(beside_given, "is_refined_candidate", lambda other, best: False)
    found = find_objection(make_search_result(after, rival), ())
    assert said in found
    assert bool(found) == bool(said)
