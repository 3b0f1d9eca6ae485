"""The proposed recordings tell invented rivals apart, and nothing is proposed where none of the menu would."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.diagnosis.data.recorded_conditions import add_mass
from analysis.diagnosis.errors.hypothesis import Claim, hypothesis_of_claim
from analysis.diagnosis.errors.output_error import Fitted
from analysis.diagnosis.errors.tuning import tuning_of
from analysis.diagnosis.next_experiment.choose_experiment import (
    MOST_TOGETHER,
    Bench,
    PredictedGain,
    as_document,
    choose_set,
    predict_gains,
)
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
    bench, (named, rival), gains = friction
    chosen = choose_set([gains])
    proposed = as_document(chosen, NAMES)
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
    assert cost[1] - cost[0] > 2 * TELLING_GAIN


def test_of_recordings_that_tell_alone_the_one_with_the_largest_gain_for_its_cost_is_chosen(friction):
    _, _, gains = friction
    (chosen,) = choose_set([gains]).experiments
    worth = {each.experiment.words: each.gain / each.experiment.minutes for each in gains if each.gain >= TELLING_GAIN}
    assert worth[chosen.words] == max(worth.values()) > 3 * min(each.gain / each.experiment.minutes for each in gains)


def test_a_law_and_itself_are_never_told_apart(friction):
    bench, (named, _), _ = friction
    same = foreseen(bench, named, named)
    assert as_document(choose_set([same]), (NAMES[0], NAMES[0])) is None


def gains_of(*rows):
    """Per rival, invented gains of the first recordings of a menu."""
    menu = experiment_menu(bench_of().tuning.model, RATE_HZ, 0, LEVEL_N)
    return [[PredictedGain(menu[number], gain, gain) for number, gain in enumerate(row)] for row in rows]


def words_of(chosen):
    menu = [each.words for each in experiment_menu(bench_of().tuning.model, RATE_HZ, 0, LEVEL_N)]
    return [menu.index(experiment.words) for experiment in chosen.experiments]


TELLS, HALF = 3 * TELLING_GAIN, 0.6 * TELLING_GAIN


def test_one_recording_that_tells_every_rival_is_preferred_to_two():
    chosen = choose_set(gains_of([9 * TELLS, 0, TELLS], [0, 9 * TELLS, TELLS]))
    assert words_of(chosen) == [2]
    assert chosen.discriminated == (0, 1)
    assert chosen.gain == pytest.approx(TELLS)


def test_rivals_that_no_recording_tells_at_once_need_two():
    chosen = choose_set(gains_of([TELLS, 0, 0], [0, 0, TELLS]))
    assert sorted(words_of(chosen)) == [0, 2]
    assert chosen.discriminated == (0, 1)


def test_gains_of_several_recordings_add_up():
    chosen = choose_set(gains_of([HALF, 0, HALF]))
    assert sorted(words_of(chosen)) == [0, 2]
    assert chosen.gain == pytest.approx(2 * HALF)
    said = as_document(chosen, NAMES)
    assert said.command.count("; then ") == 1
    assert "together" in said.why


def test_a_rival_that_nothing_tells_does_not_hinder_the_others():
    chosen = choose_set(gains_of([0.1, 0.1, 0.1], [0, TELLS, 0]))
    assert words_of(chosen) == [1]
    assert as_document(chosen, ("a", "b", "c")).splits == ("a", "c")


def test_no_more_recordings_are_proposed_than_a_laboratory_would_make():
    small = 0.3 * TELLING_GAIN
    assert choose_set(gains_of([small, small, small, small])).experiments == ()
    chosen = choose_set(gains_of(*np.diag([TELLS] * 5).tolist()))
    assert len(chosen.experiments) == len(chosen.discriminated) == MOST_TOGETHER


def test_a_recording_that_no_rival_needs_is_not_proposed():
    assert words_of(choose_set(gains_of([TELLS, 0, 0, 0], [0, HALF, HALF, 0]))) == [0, 1, 2]
    third = 0.4 * TELLING_GAIN
    assert words_of(choose_set(gains_of([TELLS, 0, 0, 0], [0.0, third, third, third]))) == [0]


def test_the_prior_is_counted_once_for_several_recordings():
    """Two equal recordings, whose difference the tolerance of a calibration can hide: r = d - s * theta, K = 1."""
    bench, named, rival = mass_or_gain(LOOSE)
    menu = experiment_menu(bench.tuning.model, RATE_HZ, 0, LEVEL_N)[:2]
    gains = predict_gains(bench, named, rival, known_of(bench, rival, 1e9), menu)
    assert all(0 <= each.shared <= each.gain for each in gains)
    assert any(each.shared < 0.9 * each.gain for each in gains)


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
    gains = foreseen(*mass_or_gain(Tolerance(1e-4, 0.01, 0.1, 0.01), fitted=False))
    assert as_document(choose_set([gains]), ("added_mass", "force_gain")) is not None


def test_what_the_tolerance_can_hide_tells_nothing():
    gains = foreseen(*mass_or_gain(LOOSE))
    assert as_document(choose_set([gains]), ("added_mass", "force_gain")) is None


def test_a_weight_strapped_on_tells_what_no_louder_sweep_can():
    bench, named, rival = mass_or_gain(LOOSE)
    menu = experiment_menu(bench.tuning.model, RATE_HZ, 0, LEVEL_N)
    size = len(bench.tuning.names) + 1
    gains = predict_gains(bench, named, rival, np.diag([1e9] * size), menu)
    *others, weight = gains
    (chosen,) = choose_set([gains]).experiments
    assert "strapped to the handle" in chosen.words
    assert weight.gain > TELLING_GAIN
    assert all(other.gain < weight.gain / 3 for other in others)


def test_what_was_recorded_so_far_holds_the_rival(friction):
    bench, (named, rival), gains = friction
    held = foreseen(bench, named, rival, numbers=1e12)
    assert max(each.gain for each in held) >= max(each.gain for each in gains)


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
    small = replace(sweep, commands=sweep.commands / 50)
    gains = predict_gains(bench, named, rival, known, (small, dear))
    assert choose_set([gains]).experiments == (dear,)
    assert gains[0].gain < TELLING_GAIN < gains[1].gain


def test_an_axis_that_no_stiffness_holds_is_not_pushed_away():
    held = bench_of().tuning.model
    free = replace(held, stiffness=np.zeros((1, 1)))
    pushes = [
        sum(np.abs(each.commands.mean()) > 0.1 for each in experiment_menu(m, RATE_HZ, 0, LEVEL_N))
        for m in (held, free)
    ]
    assert pushes == [1, 0]
    assert [each.kind for each in experiment_menu(held, RATE_HZ, 0, LEVEL_N)].count("step") == 1


def test_a_body_on_a_spring_to_another_free_body_is_not_held():
    """Its stiffness matrix has a diagonal, and nothing grounds it."""
    mass, spring = 0.2 * np.eye(2), 1e4 * np.array([[1.0, -1.0], [-1.0, 1.0]])
    one = [[1.0], [0.0]]
    free = MechanicalModel("two", "acceleration", mass, 0.4 * np.eye(2), spring, one, np.transpose(one))
    soft = replace(free, stiffness=spring + 0.05 * np.eye(2))
    held = replace(free, stiffness=spring + 500.0 * np.eye(2))
    kinds = [[each.kind for each in experiment_menu(model, RATE_HZ, 0, LEVEL_N)] for model in (free, soft, held)]
    assert [each.count("step") for each in kinds] == [0, 0, 1]


def test_a_release_ends_at_once_and_leaves_time_to_move_freely():
    (release,) = (each for each in experiment_menu(bench_of().tuning.model, RATE_HZ, 0, LEVEL_N) if each.kind == "step")
    command = release.commands[:, 0]
    (ends,) = np.nonzero(np.abs(np.diff(command)) > 0.9 * LEVEL_N)
    assert len(ends) == 4
    assert np.sign(command[ends]).tolist() == [1, -1, 1, -1]
    assert all((command[end + 1 : end + 900] == 0).all() for end in ends)
