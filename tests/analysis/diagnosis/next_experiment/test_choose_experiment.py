"""The proposed recordings tell invented rivals apart, and nothing is proposed where none of the menu would."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.diagnosis.data.recorded_conditions import add_mass
from analysis.diagnosis.errors.hypothesis import Claim, make_claim_hypothesis
from analysis.diagnosis.errors.output_error import Fitted
from analysis.diagnosis.errors.tuning import make_tuning
from analysis.diagnosis.limits import DISCRIMINATING_GAIN
from analysis.diagnosis.next_experiment.choose_experiment import (
    MOST_RECORDINGS,
    Bench,
    PredictedGain,
    choose_experiments,
    make_document_entry,
    predict_gains,
)
from analysis.diagnosis.next_experiment.experiment_menu import list_experiments
from equalizer.effects.catalogue import EFFECTS
from equalizer.effects.simulation.simulator import simulate_mechanism
from equalizer.plant.linear_simulation import compute_driven_axes
from equalizer.plant.mechanical_model import MechanicalModel, MechanicalModelError, SensorLimits, Tolerance
from equalizer.signals.recording import Hold
from equalizer.signals.unit_system import UnitSystem

RATE_HZ, LEVEL_N = 1000.0, 3.0
KNOWN = Tolerance(0.003, 0.1, 2.0, 0.01)
NOISE = np.array([0.05, 4e-6])
NAMES = ("coulomb_friction", "presliding_hysteresis")


def make_bench(tolerance=KNOWN):
    unit = [[1.0]]
    model = MechanicalModel(
        "small", "acceleration", [[0.25]], [[4.0]], [[130.0]], unit, unit, SensorLimits(400.0, 0.0), tolerance=tolerance
    )
    return Bench(make_tuning(model, ("fx",)), RATE_HZ, Hold.ZERO_ORDER, NOISE)


def make_fit(bench, name, values):
    effect = EFFECTS[name]
    whole = make_claim_hypothesis(Claim(effect, "one", (0,)), [values])
    return Fitted(whole, np.zeros(len(bench.tuning.names)), (), 0.0)


def known_precision(bench, fitted, numbers=0.0):
    """Nothing recorded so far but the calibration; `numbers`: how well the rival's own are known."""
    size = len(bench.tuning.names) + len(fitted.hypothesis.point)
    return np.diag([1.0] * len(bench.tuning.names) + [numbers] * (size - len(bench.tuning.names)))


def predict_menu_gains(bench, named, rival, numbers=0.0):
    menu = list_experiments(bench.tuning.model, RATE_HZ, 0, LEVEL_N)
    return predict_gains(bench, named, rival, known_precision(bench, rival, numbers), menu)


@pytest.mark.parametrize("rate_hz", [0.5, 1.74, 20.0, 400.0, 20_000.0])
def test_experiments_suit_the_sample_rate(rate_hz):
    for experiment in list_experiments(make_bench().tuning.model, rate_hz, 0, LEVEL_N):
        assert 60 <= len(experiment.commands) <= max(40 * rate_hz, 2000)
        assert np.abs(experiment.commands).max() <= LEVEL_N


@pytest.fixture(scope="module")
def friction_choice():
    """Two laws alike in the large, and the experiments, the best first."""
    bench = make_bench()
    pair = (
        make_fit(bench, "coulomb_friction", {"level": 0.1}),
        make_fit(bench, "presliding_hysteresis", {"level": 0.1, "stiffness": 0.1 / 1e-4}),
    )
    return bench, pair, predict_menu_gains(bench, *pair)


@pytest.mark.slow
def test_dry_friction_and_presliding_are_distinguished_by_the_proposed_recording(friction_choice):
    bench, (named, rival), gains = friction_choice
    chosen = choose_experiments([gains])
    proposed = make_document_entry(chosen, NAMES)
    assert proposed is not None and proposed.splits == NAMES
    (experiment,) = chosen.experiments
    command = experiment.commands
    played = [
        simulate_mechanism(bench.tuning.model, command, RATE_HZ, each.hypothesis.list_placed_effects())
        for each in (named, rival)
    ]
    truth, other = (np.hstack([each.response, each.position]) for each in played)
    measured = truth + NOISE * np.random.default_rng(1).standard_normal(truth.shape)
    cost = [float(np.sum(((measured - each) / NOISE) ** 2)) for each in (truth, other)]
    assert cost[1] - cost[0] > 2 * DISCRIMINATING_GAIN


@pytest.mark.slow
def test_of_recordings_that_tell_alone_the_one_with_the_largest_gain_for_its_cost_is_chosen(friction_choice):
    _, _, gains = friction_choice
    (chosen,) = choose_experiments([gains]).experiments
    worth = {
        each.experiment.words: each.gain / each.experiment.minutes for each in gains if each.gain >= DISCRIMINATING_GAIN
    }
    assert worth[chosen.words] == max(worth.values()) > 3 * min(each.gain / each.experiment.minutes for each in gains)


@pytest.mark.slow
def test_a_law_and_itself_are_never_told_apart(friction_choice):
    bench, (named, _), _ = friction_choice
    same = predict_menu_gains(bench, named, named)
    assert make_document_entry(choose_experiments([same]), (NAMES[0], NAMES[0])) is None


def make_gains(*rows):
    """Per rival, invented gains of the first recordings of a menu."""
    menu = list_experiments(make_bench().tuning.model, RATE_HZ, 0, LEVEL_N)
    return [[PredictedGain(menu[number], gain, gain) for number, gain in enumerate(row)] for row in rows]


def menu_numbers(chosen):
    menu = [each.words for each in list_experiments(make_bench().tuning.model, RATE_HZ, 0, LEVEL_N)]
    return [menu.index(experiment.words) for experiment in chosen.experiments]


TELLS, HALF = 3 * DISCRIMINATING_GAIN, 0.6 * DISCRIMINATING_GAIN


def test_one_recording_that_tells_every_rival_is_preferred_to_two():
    chosen = choose_experiments(make_gains([9 * TELLS, 0, TELLS], [0, 9 * TELLS, TELLS]))
    assert menu_numbers(chosen) == [2]
    assert chosen.discriminated == (0, 1)
    assert chosen.gain == pytest.approx(TELLS)


def test_rivals_that_no_recording_tells_at_once_need_two():
    chosen = choose_experiments(make_gains([TELLS, 0, 0], [0, 0, TELLS]))
    assert sorted(menu_numbers(chosen)) == [0, 2]
    assert chosen.discriminated == (0, 1)


def test_gains_of_several_recordings_add_up():
    chosen = choose_experiments(make_gains([HALF, 0, HALF]))
    assert sorted(menu_numbers(chosen)) == [0, 2]
    assert chosen.gain == pytest.approx(2 * HALF)
    said = make_document_entry(chosen, NAMES)
    assert said.command.count("; then ") == 1
    assert "together" in said.why


def test_a_rival_that_nothing_tells_does_not_hinder_the_others():
    chosen = choose_experiments(make_gains([0.1, 0.1, 0.1], [0, TELLS, 0]))
    assert menu_numbers(chosen) == [1]
    assert make_document_entry(chosen, ("a", "b", "c")).splits == ("a", "c")


def test_no_more_recordings_are_proposed_than_a_laboratory_would_make():
    small = 0.3 * DISCRIMINATING_GAIN
    assert choose_experiments(make_gains([small, small, small, small])).experiments == ()
    chosen = choose_experiments(make_gains(*np.diag([TELLS] * 5).tolist()))
    assert len(chosen.experiments) == len(chosen.discriminated) == MOST_RECORDINGS


def test_a_recording_that_no_rival_needs_is_not_proposed():
    assert menu_numbers(choose_experiments(make_gains([TELLS, 0, 0, 0], [0, HALF, HALF, 0]))) == [0, 1, 2]
    third = 0.4 * DISCRIMINATING_GAIN
    assert menu_numbers(choose_experiments(make_gains([TELLS, 0, 0, 0], [0.0, third, third, third]))) == [0]


def test_the_prior_is_counted_once_for_several_recordings():
    """Two equal recordings, whose difference the tolerance of a calibration can hide: r = d - s * theta, K = 1."""
    bench, named, rival = compare_mass_and_gain(LOOSE)
    menu = list_experiments(bench.tuning.model, RATE_HZ, 0, LEVEL_N)[:2]
    gains = predict_gains(bench, named, rival, known_precision(bench, rival, 1e9), menu)
    assert all(0 <= each.shared <= each.gain for each in gains)
    assert any(each.shared < 0.9 * each.gain for each in gains)


ADDED_KG, GAIN = 0.012, 0.955
LOOSE = Tolerance(0.05, 2.0, 60.0, 0.01)


def compare_mass_and_gain(tolerance, fitted=True):
    """A handle with more mass, and a motor that is weaker; fitted: in a device that is lighter, looser and softer, so
    that the two answer alike, but for a thousandth."""
    bench = make_bench(tolerance)
    named, rival = make_fit(bench, "added_mass", {"mass": ADDED_KG}), make_fit(bench, "force_gain", {"gain": GAIN})
    model = bench.tuning.model
    wanted = [GAIN * (model.mass[0, 0] + ADDED_KG), GAIN * model.damping[0, 0], GAIN * model.stiffness[0, 0]]
    given = [model.mass[0, 0], model.damping[0, 0], model.stiffness[0, 0]]
    alike = 1.001 * (np.array(wanted) - given) / bench.tuning.deviation
    return bench, named, replace(rival, deviations=alike) if fitted else rival


def test_a_weight_and_a_weak_motor_are_distinguished_where_the_calibration_is_tight():
    gains = predict_menu_gains(*compare_mass_and_gain(Tolerance(1e-4, 0.01, 0.1, 0.01), fitted=False))
    assert make_document_entry(choose_experiments([gains]), ("added_mass", "force_gain")) is not None


def test_what_the_tolerance_can_hide_tells_nothing():
    gains = predict_menu_gains(*compare_mass_and_gain(LOOSE))
    assert make_document_entry(choose_experiments([gains]), ("added_mass", "force_gain")) is None


def test_a_weight_strapped_on_tells_what_no_louder_sweep_can():
    bench, named, rival = compare_mass_and_gain(LOOSE)
    menu = list_experiments(bench.tuning.model, RATE_HZ, 0, LEVEL_N)
    size = len(bench.tuning.names) + 1
    gains = predict_gains(bench, named, rival, np.diag([1e9] * size), menu)
    *others, weight = gains
    (chosen,) = choose_experiments([gains]).experiments
    assert "strapped to the handle" in chosen.words
    assert weight.gain > DISCRIMINATING_GAIN
    assert all(other.gain < weight.gain / 3 for other in others)


@pytest.mark.slow
def test_what_was_recorded_so_far_holds_the_rival(friction_choice):
    bench, (named, rival), gains = friction_choice
    held = predict_menu_gains(bench, named, rival, numbers=1e12)
    assert max(each.gain for each in held) >= max(each.gain for each in gains)


def test_nothing_louder_than_before_is_proposed():
    bench = make_bench()
    for each in list_experiments(bench.tuning.model, RATE_HZ, 0, LEVEL_N):
        assert np.abs(each.commands).max() <= LEVEL_N * (1 + 1e-9)
        assert each.commands[0, 0] == pytest.approx(0.0, abs=1e-6)


def test_a_weight_is_the_same_along_every_driven_axis():
    turn = np.linalg.qr(np.random.default_rng(2).normal(size=(3, 3)))[0]
    eye = np.eye(3)
    model = MechanicalModel("three", "acceleration", eye, eye, eye, turn, turn.T)
    axes = compute_driven_axes(model)
    assert axes.T @ (add_mass(model, 0.03).mass - model.mass) @ axes == pytest.approx(0.03 * eye)


def test_an_informative_expensive_recording_ranks_before_a_cheap_uninformative_one():
    bench, named, rival = compare_mass_and_gain(LOOSE)
    sweep, *_, weight = list_experiments(bench.tuning.model, RATE_HZ, 0, LEVEL_N)
    known = np.diag([1e9] * (len(bench.tuning.names) + 1))
    dear = replace(weight, minutes=1e6)
    small = replace(sweep, commands=sweep.commands / 50)
    gains = predict_gains(bench, named, rival, known, (small, dear))
    assert choose_experiments([gains]).experiments == (dear,)
    assert gains[0].gain < DISCRIMINATING_GAIN < gains[1].gain


@pytest.mark.parametrize("units", [UnitSystem("A", "m"), UnitSystem("N", "mm"), UnitSystem("A", "rad")])
def test_no_known_mass_is_proposed_where_that_of_the_model_is_not_in_kg(units):
    model = make_bench().tuning.model
    weighed, unweighed = (list_experiments(m, RATE_HZ, 0, LEVEL_N) for m in (model, replace(model, units=units)))
    assert [each.words for each in unweighed] == [each.words for each in weighed if not each.added]


def test_an_axis_that_no_stiffness_holds_is_not_pushed_away():
    held = make_bench().tuning.model
    free = replace(held, stiffness=np.zeros((1, 1)))
    pushes = [
        sum(np.abs(each.commands.mean()) > 0.1 for each in list_experiments(m, RATE_HZ, 0, LEVEL_N))
        for m in (held, free)
    ]
    assert pushes == [1, 0]
    assert [each.kind for each in list_experiments(held, RATE_HZ, 0, LEVEL_N)].count("step") == 1


def test_a_body_on_a_spring_to_another_free_body_is_not_held():
    """Its stiffness matrix has a diagonal, and nothing grounds it."""
    mass, spring = 0.2 * np.eye(2), 1e4 * np.array([[1.0, -1.0], [-1.0, 1.0]])
    one = [[1.0], [0.0]]
    free = MechanicalModel("two", "acceleration", mass, 0.4 * np.eye(2), spring, one, np.transpose(one))
    soft = replace(free, stiffness=spring + 0.05 * np.eye(2))
    held = replace(free, stiffness=spring + 500.0 * np.eye(2))
    kinds = [[each.kind for each in list_experiments(model, RATE_HZ, 0, LEVEL_N)] for model in (free, soft, held)]
    assert [each.count("step") for each in kinds] == [0, 0, 1]


def test_a_release_ends_at_once_and_leaves_time_to_move_freely():
    (release,) = (
        each for each in list_experiments(make_bench().tuning.model, RATE_HZ, 0, LEVEL_N) if each.kind == "step"
    )
    command = release.commands[:, 0]
    (ends,) = np.nonzero(np.abs(np.diff(command)) > 0.9 * LEVEL_N)
    assert len(ends) == 4
    assert np.sign(command[ends]).tolist() == [1, -1, 1, -1]
    assert all((command[end + 1 : end + 900] == 0).all() for end in ends)


def test_a_step_to_a_model_that_cannot_be_is_taken_the_other_way():
    bench, named, rival = compare_mass_and_gain(LOOSE)
    tune = bench.tuning.tune

    def tune_below(deviations):
        if deviations[0] > rival.deviations[0]:
            raise MechanicalModelError(("the mass is not positive definite",))
        return tune(deviations)

    limited = replace(bench, tuning=replace(bench.tuning, tune=tune_below))
    gains, expected = (predict_menu_gains(each, named, rival) for each in (limited, bench))
    assert [each.gain for each in gains] == pytest.approx([each.gain for each in expected], rel=0.1, abs=0.1)
