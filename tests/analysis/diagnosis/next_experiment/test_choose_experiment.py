"""The proposed recording tells an invented pair apart, and says so where none of the menu would."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.diagnosis.data.recorded_conditions import add_mass
from analysis.diagnosis.errors.hypothesis import Claim, hypothesis_of_claim
from analysis.diagnosis.errors.output_error import Fitted
from analysis.diagnosis.errors.tuning import tuning_of
from analysis.diagnosis.next_experiment.choose_experiment import Bench, as_document, predict_gains
from analysis.diagnosis.next_experiment.experiment_menu import experiment_menu
from analysis.diagnosis.settings import TELLING_GAIN
from equalizer.effects.catalogue import EFFECTS
from equalizer.effects.simulation.simulator import simulate_mechanism
from equalizer.plant.linear_simulation import driven_axes
from equalizer.plant.mechanical_model import MechanicalModel, SensorLimits, Tolerance
from equalizer.signals.recording import Hold

RATE_HZ, LEVEL_N = 1000.0, 3.0
KNOWN = Tolerance(0.003, 0.1, 2.0, 0.01)
NOISE = np.array([0.05, 4e-6])
NAMES = ("coulomb_friction", "presliding_hysteresis")


def bench_of(tolerance=KNOWN):
    unit = [[1.0]]
    model = MechanicalModel(
        "small", "acceleration", [[0.25]], [[4.0]], [[130.0]], unit, unit, SensorLimits(400.0, 0.0), tolerance=tolerance
    )
    return Bench(tuning_of(model, ("fx",)), RATE_HZ, Hold.ZERO_ORDER, NOISE)


def said(bench, name, values):
    effect = EFFECTS[name]
    whole = hypothesis_of_claim(Claim(effect, "one", (0,)), [values])
    return Fitted(whole, np.zeros(len(bench.tuning.names)), (), 0.0)


def known_of(bench, fitted, numbers=0.0):
    """Nothing recorded so far but the calibration; `numbers`: how well the rival's own are known."""
    size = len(bench.tuning.names) + len(fitted.hypothesis.point)
    return np.diag([1.0] * len(bench.tuning.names) + [numbers] * (size - len(bench.tuning.names)))


def foreseen(bench, named, rival, numbers=0.0):
    menu = experiment_menu(bench.tuning.model, RATE_HZ, 0, LEVEL_N)
    return predict_gains(bench, named, rival, known_of(bench, rival, numbers), menu)


@pytest.mark.parametrize("rate_hz", [0.5, 1.74, 20.0, 400.0, 20_000.0])
def test_experiments_suit_the_sample_rate(rate_hz):
    for experiment in experiment_menu(bench_of().tuning.model, rate_hz, 0, LEVEL_N):
        assert 60 <= len(experiment.commands) <= max(40 * rate_hz, 2000)
        assert np.abs(experiment.commands).max() <= LEVEL_N


@pytest.fixture(scope="module")
def friction():
    """Two laws alike in the large, and the experiments, the best first."""
    bench = bench_of()
    pair = (
        said(bench, "coulomb_friction", {"level": 0.1}),
        said(bench, "presliding_hysteresis", {"level": 0.1, "stiffness": 0.1 / 1e-4}),
    )
    return bench, pair, foreseen(bench, *pair)


def test_dry_friction_and_presliding_are_distinguished_by_the_proposed_recording(friction):
    bench, (named, rival), menu = friction
    proposed = as_document(menu[0], NAMES)
    assert proposed is not None and proposed.splits == NAMES
    command = menu[0].experiment.commands
    played = [
        simulate_mechanism(bench.tuning.model, command, RATE_HZ, each.hypothesis.placed_effects())
        for each in (named, rival)
    ]
    truth, other = (np.hstack([each.response, each.position]) for each in played)
    measured = truth + NOISE * np.random.default_rng(1).standard_normal(truth.shape)
    cost = [float(np.sum(((measured - each) / NOISE) ** 2)) for each in (truth, other)]
    assert cost[1] - cost[0] > 2 * TELLING_GAIN


def test_what_tells_most_for_its_cost_comes_first(friction):
    _, _, menu = friction
    worth = [each.gain / each.experiment.minutes for each in menu]
    assert worth == sorted(worth, reverse=True)
    assert worth[0] > 3 * worth[-1]


def test_a_law_and_itself_are_never_told_apart(friction):
    bench, (named, _), _ = friction
    same = foreseen(bench, named, named)
    assert as_document(same[0], (NAMES[0], NAMES[0])) is None


ADDED_KG, GAIN = 0.012, 0.955
LOOSE = Tolerance(0.05, 2.0, 60.0, 0.01)


def mass_or_gain(tolerance, fitted=True):
    """A handle with more mass, and a motor that is weaker; fitted: in a device that is lighter, looser and softer, so
    that the two answer alike, but for a thousandth."""
    bench = bench_of(tolerance)
    named, rival = said(bench, "added_mass", {"mass": ADDED_KG}), said(bench, "force_gain", {"gain": GAIN})
    model = bench.tuning.model
    wanted = [GAIN * (model.mass[0, 0] + ADDED_KG), GAIN * model.damping[0, 0], GAIN * model.stiffness[0, 0]]
    given = [model.mass[0, 0], model.damping[0, 0], model.stiffness[0, 0]]
    alike = 1.001 * (np.array(wanted) - given) / bench.tuning.deviation
    return bench, named, replace(rival, deviations=alike) if fitted else rival


def test_a_weight_and_a_weak_motor_are_distinguished_where_the_calibration_is_tight():
    menu = foreseen(*mass_or_gain(Tolerance(1e-4, 0.01, 0.1, 0.01), fitted=False))
    assert as_document(menu[0], ("added_mass", "force_gain")) is not None


def test_what_the_tolerance_can_hide_tells_nothing():
    menu = foreseen(*mass_or_gain(LOOSE))
    assert as_document(menu[0], ("added_mass", "force_gain")) is None


def test_a_weight_strapped_on_tells_what_no_louder_sweep_can():
    bench, named, rival = mass_or_gain(LOOSE)
    menu = experiment_menu(bench.tuning.model, RATE_HZ, 0, LEVEL_N)
    size = len(bench.tuning.names) + 1
    first, *others = predict_gains(bench, named, rival, np.diag([1e9] * size), menu)
    assert "strapped to the handle" in first.experiment.words
    assert first.gain > TELLING_GAIN
    assert all(other.gain < first.gain / 3 for other in others)


def test_what_was_recorded_so_far_holds_the_rival(friction):
    bench, (named, rival), menu = friction
    held = foreseen(bench, named, rival, numbers=1e12)
    assert held[0].gain >= menu[0].gain


def test_nothing_louder_than_before_is_proposed():
    bench = bench_of()
    for each in experiment_menu(bench.tuning.model, RATE_HZ, 0, LEVEL_N):
        assert np.abs(each.commands).max() <= LEVEL_N * (1 + 1e-9)
        assert each.commands[0, 0] == pytest.approx(0.0, abs=1e-6)


def test_a_weight_is_the_same_along_every_driven_axis():
    turn = np.linalg.qr(np.random.default_rng(2).normal(size=(3, 3)))[0]
    eye = np.eye(3)
    model = MechanicalModel("three", "acceleration", eye, eye, eye, turn, turn.T)
    axes = driven_axes(model)
    assert axes.T @ (add_mass(model, 0.03).mass - model.mass) @ axes == pytest.approx(0.03 * eye)


def test_an_informative_expensive_recording_ranks_before_a_cheap_uninformative_one():
    bench, named, rival = mass_or_gain(LOOSE)
    sweep, *_, weight = experiment_menu(bench.tuning.model, RATE_HZ, 0, LEVEL_N)
    known = np.diag([1e9] * (len(bench.tuning.names) + 1))
    dear = replace(weight, minutes=1e6)
    first, second = predict_gains(bench, named, rival, known, (replace(sweep, commands=sweep.commands / 50), dear))
    assert first.experiment is dear
    assert second.gain < TELLING_GAIN < first.gain
