"""Laws of commands, of readings and of pairs of axes are found in simulated recordings. Compiles."""

from dataclasses import replace
from functools import reduce
from types import SimpleNamespace

import numpy as np
import pytest

from analysis.diagnosis.discovery.antisymmetric_pairs import (
    can_coupling_imitate,
    convert_to_pair,
    find_antisymmetric_pairs,
    make_antisymmetric,
)
from analysis.diagnosis.discovery.convert_sum import convert_sum_to_hypothesis, convert_sum_to_law, list_fitted_laws
from analysis.diagnosis.discovery.discover import discover_laws
from analysis.diagnosis.discovery.fit_sum import Sum
from analysis.diagnosis.discovery.grammar import Term
from analysis.diagnosis.discovery.matched_filter import build_views
from analysis.diagnosis.discovery.view_terms import list_reading_terms
from analysis.diagnosis.document import Candidate, diagnosis_from_json, make_found_law
from analysis.diagnosis.errors.hypothesis import NO_EFFECTS, Claim, combine_hypotheses, make_claim_hypothesis
from analysis.diagnosis.errors.output_error import evaluate_fit
from analysis.diagnosis.errors.tuning import make_tuning
from analysis.diagnosis.result.candidates import add_balances_with_given_model
from equalizer.effects.discovered_law import Channels, get_law_values, make_law_effect, make_law_parameters
from equalizer.effects.effect import PlacedEffect
from equalizer.laws.law import Law
from equalizer.plant.mechanical_model import Tolerance
from tests.diagnosed import device
from tests.diagnosed import recorded as recorded_on_axes
from tests.lawful import arena_of, law, recorded


def ignore_progress(said, share):
    pass


def test_a_force_that_grows_with_time_is_no_coupling_of_axes():
    drift = Law("p0*t", (0.1,), (), "force", "x")
    claim = Claim(make_law_effect(drift), "one", (0,))
    fitted = SimpleNamespace(hypothesis=make_claim_hypothesis(claim, [get_law_values(drift)]))
    assert not can_coupling_imitate(None, fitted, ("fx", "fy"))


@pytest.mark.parametrize("forces", [1, 2])
def test_a_coupling_without_tolerance_takes_no_part_of_a_force_or_pair(forces):
    tuning = make_tuning(replace(device(2), tolerance=Tolerance(0.0003, 0.0, 0.8, 0.01)), ("fx", "fy"))
    claims = [
        make_claim_hypothesis(Claim(placed.effect, "one", placed.sites), [placed.values])
        for placed in whirl_forces(0.6)[:forces]
    ]
    fitted = SimpleNamespace(hypothesis=reduce(combine_hypotheses, claims), deviations=np.zeros(len(tuning.names)))
    measure = SimpleNamespace(records=[SimpleNamespace(recording=recorded_on_axes(2))])
    assert not can_coupling_imitate(tuning, fitted, ("fx", "fy"))
    assert make_antisymmetric(measure, tuning, fitted) is fitted


def always():
    return True


def search_for_laws(recording, model=None):
    context, known = arena_of(recording, model)
    return context, discover_laws(context, known, ignore_progress, always)


@pytest.mark.parametrize("seed", [1])
@pytest.mark.parametrize(
    ("true", "shape"),
    [
        pytest.param(law("fx + p0*fx**2", 0.05, acts_on="command"), "fx + p0*fx**2", marks=pytest.mark.slow),
        pytest.param(law("p0*tanh(fx/p0)", 2.0, acts_on="command"), "tanh(fx/p0)*p0", marks=pytest.mark.slow),
        (law("ax + p0*ax**2", 0.01, acts_on="response"), "ax + p0*ax**2"),
        pytest.param(law("p0*atan(ax/p0)", 10.0, acts_on="response"), "atan(ax/p0)*p0", marks=pytest.mark.slow),
    ],
)
def test_laws_of_commands_and_readings_are_found_where_they_act(true, shape, seed):
    _, found = search_for_laws(recorded((true,), seed))
    assert found is not None
    said = list_fitted_laws(found.explanation.after.fitted.hypothesis)
    assert len(said) == 1
    assert said[0] is not None
    assert (said[0].acts_on, said[0].expression) == (true.acts_on, shape)
    assert said[0].numbers[-1] == pytest.approx(true.numbers[0], rel=0.05)


def whirl_forces(size, sign=-1.0):
    """Forces of each axis on the other: antisymmetric, or by `sign` 1 symmetric."""
    channels = Channels(("fx", "fy"), ("ax", "ay"))
    laws = (Law("p0*vy", (size,), (), "force", "x"), Law("p0*vx", (sign * size,), (), "force", "y"))
    return [
        PlacedEffect(make_law_effect(each, channels), (axis,), get_law_values(each)) for axis, each in enumerate(laws)
    ]


@pytest.mark.slow
def test_a_gyroscopic_pair_is_one_law_of_two_axes(seed=4):
    _, found = search_for_laws(recorded_on_axes(2, whirl_forces(0.6), seed), device(2))
    assert found is not None
    laws = list_fitted_laws(found.explanation.after.fitted.hypothesis)
    assert [each and each.expression for each in laws] == ["p0*vy", "p0*vx"]
    assert [each.numbers[0] for each in laws if each is not None] == pytest.approx([0.6, -0.6], rel=0.02)
    assert len(found.explanation.rounds) == len(found.explanation.steps) == 2


@pytest.mark.slow
def test_a_pair_has_equal_halves_and_is_told_from_one_force_only_by_the_calibration(seed=4):
    recording = recorded_on_axes(2, whirl_forces(0.6), seed)
    context, known = arena_of(recording, device(2))
    measure, tuning = context.measure, context.tuning
    fitted = evaluate_fit(measure, tuning, known.retuned.fitted.deviations, NO_EFFECTS)
    pairs = list(find_antisymmetric_pairs(build_views(measure, tuning, fitted)))
    pair = min(pairs, key=lambda each: each.cross_validated_error)
    assert pair.variables == ("vx", "vy")
    assert pair.cross_validated_error - 1 < 0.1 * (pair.base_error - 1)
    uneven = replace(pair, factors=(0.7,), partner=replace(pair.partner, factors=(-0.5,)))
    begun = evaluate_fit(measure, tuning, fitted.deviations, convert_sum_to_hypothesis(uneven, recording))
    even = make_antisymmetric(measure, tuning, begun)
    assert [each.numbers[0] for each in list_fitted_laws(even.hypothesis) if each is not None] == pytest.approx(
        [0.6, -0.6]
    )
    apart = even.residuals[0] - begun.residuals[0]
    assert np.sqrt(np.mean(apart**2)) < 1e-3 * np.sqrt(np.mean((fitted.residuals[0] - begun.residuals[0]) ** 2))
    single = replace(pair, factors=(1.2,), partner=None)
    one = evaluate_fit(measure, tuning, fitted.deviations, convert_sum_to_hypothesis(single, recording))
    assert convert_to_pair(measure, tuning, (one, single), pair) is None  # the coupled parameter cannot take 0.6 N s/m
    inputs = recording.command.channels
    assert not can_coupling_imitate(tuning, even, inputs)
    loose = replace(tuning, deviation=100 * tuning.deviation)
    assert can_coupling_imitate(loose, even, inputs)


@pytest.mark.slow
def test_one_force_is_a_pair_of_half_its_size_beside_the_models_coupling(seed=4):
    recording = recorded_on_axes(2, whirl_forces(0.6), seed)
    context, known = arena_of(recording, replace(device(2), tolerance=Tolerance(0.0003, 0.3, 0.8, 0.01)))
    measure, tuning = context.measure, context.tuning
    pair = Sum(0, (Term("vy"),), (0.6,), 1.0, 9.0, 0.0, (), partner=Sum(1, (Term("vx"),), (-0.6,), 1.0, 9.0, 0.0, ()))
    single = replace(pair, factors=(1.2,), partner=None)
    deviations = np.zeros(len(tuning.names))
    one = evaluate_fit(measure, tuning, deviations, convert_sum_to_hypothesis(single, recording))
    found = convert_to_pair(measure, tuning, (one, single), pair)
    assert found is not None
    assert [each.numbers[0] for each in list_fitted_laws(found.hypothesis) if each is not None] == pytest.approx(
        [0.6, -0.6]
    )
    assert found.deviations[tuning.names.index("damping fx fy")] == pytest.approx(-0.6 / 0.3)
    spread = np.std(one.residuals[0] - known.retuned.fitted.residuals[0][: len(one.residuals[0])])
    assert np.std(found.residuals[0] - one.residuals[0]) < 1e-3 * spread


def test_one_force_alone_may_always_be_half_the_models_own(seed=4):
    recording = recorded_on_axes(2, whirl_forces(0.6)[:1], seed)
    context, known = arena_of(recording, device(2))
    alone = convert_sum_to_hypothesis(Sum(0, (Term("vy"),), (0.6,), 1.0, 9.0, 0.0, ()), recording)
    fitted = evaluate_fit(context.measure, context.tuning, known.retuned.fitted.deviations, alone)
    assert can_coupling_imitate(context.tuning, fitted, recording.command.channels)


def test_a_coupled_damper_is_no_pair(seed=4):
    """Both axes push each other alike: a parameter of the model, whose tolerance allows it."""
    model = replace(device(2), tolerance=Tolerance(0.0003, 0.3, 0.8, 0.01))
    assert search_for_laws(recorded_on_axes(2, whirl_forces(0.6, sign=1.0), seed), model)[1] is None


def test_a_force_of_commands_alone_is_a_law_of_the_command():
    def law_with(shape, acts_on="force"):
        return convert_sum_to_law(Sum(0, (Term(shape),), (2.0,), 1.0, 9.0, 0.0, (), acts_on), recording)

    recording = recorded((), 3)
    assert (law_with("fx**2").acts_on, law_with("fx**2").expression) == ("command", "fx + p0*fx**2")
    assert law_with("fx*lag(fx**2, 2)").acts_on == "force"
    assert law_with("fx*x").acts_on == "force"
    velocity = replace(recording, response=replace(recording.response, quantity="velocity", channels=("vx",)))
    read = convert_sum_to_law(Sum(0, (Term("ax**2"),), (2.0,), 1.0, 9.0, 0.0, (), "response"), velocity)
    assert (read.expression, read.axis) == ("vx + p0*vx**2", "x")


def test_what_is_added_to_a_signal_can_be_none():
    none = {
        each.name: each.none for each in make_law_parameters(law("fx + p0*tanh(fx/p1)", 1.0, 2.0, acts_on="command"))
    }
    assert none == {"p0": 0.0, "p1": None}
    assert make_law_parameters(law("p0*tanh(fx/p0)", 2.0, acts_on="command"))[0].none is None


def test_readings_hold_products_with_other_readings_and_nothing_linear():
    columns = {name: np.linspace(-1.0, 1.0, 50) for name in ("ax", "ay", "t")}
    shapes = [term.shape for term in list_reading_terms(columns, 1, 2)]
    assert "ay*ax" in shapes
    assert not {"ax", "ay"} & set(shapes)


def test_candidates_keep_both_laws_of_a_pair():
    errors = {"before": 2.0, "retuned": 1.0, "after": 1.0, "noise": 0.1}
    mismatch = {"output": "ay", "input": "fy", "band_hz": [1, 2], "amplitude": None, "state": None, "share": 1.0,
                "p_value": 0.0}  # fmt: skip
    nothing_named = diagnosis_from_json(
        {"verdict": "unexplained", "mismatch": [mismatch], "effects": [], "retuned": {}, "remainder": [],
         "fit": {"fit": errors, "test": errors}, "error": "free simulation", "next_experiment": None}
    )  # fmt: skip
    pair = [make_found_law(each) for each in (law("p0*vy", 0.6), replace(law("p0*vx", -0.6), axis="y"))]
    said = [Candidate("discovered_law", "mechanism", each.axis, {}, 0.5, 0.5, "no", law=each) for each in pair]
    again = (*said, said[0])
    assert add_balances_with_given_model(nothing_named, (), again, ("fx", "fy")).candidates == tuple(said)
