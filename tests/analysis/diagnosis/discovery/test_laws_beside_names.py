"""Names that may only approximate a law that the catalogue lacks, and the shorter law in their place. Compiles."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from analysis.diagnosis.discovery.add_laws import LawSearch, _yield_candidates, check_laws, may_approximate_law
from analysis.diagnosis.discovery.convert_sum import list_fitted_laws
from analysis.diagnosis.discovery.discover import discover_laws
from analysis.diagnosis.discovery.validation import is_shorter_and_as_good
from analysis.diagnosis.errors.hypothesis import Claim, combine_hypotheses, make_claim_hypothesis
from analysis.diagnosis.errors.output_error import evaluate_fit
from analysis.diagnosis.search.compare_candidates import refine
from analysis.diagnosis.search.time_budget import CountedBudget
from analysis.diagnosis.search.verdict import SearchResult, judge
from equalizer.effects.catalogue import EFFECTS
from equalizer.effects.discovered_law import get_law_values, make_law_effect
from tests.lawful import arena_of, law, recorded

CUBIC = 4e4


def ignore_progress(said, share):
    pass


def always():
    return True


def make_hypothesis(name, **values):
    return make_claim_hypothesis(Claim(EFFECTS[name], "one", (0,)), [values])


@pytest.fixture(scope="module")
def hardening_context():
    return arena_of(recorded((law("-p0*x**3", CUBIC),), 3))


def make_named_search(of, *claims, fitted=True):
    """As if the search had named these."""
    context, known = of
    whole = None
    for each in claims:
        whole = each if whole is None else combine_hypotheses(whole, each)
    start = evaluate_fit(context.measure, context.tuning, known.retuned.fitted.deviations, whole)
    step = context.score_fit(refine(context, start) if fitted else start)
    return replace(known, after=context.with_test_score(step), steps=(step,), rounds=((step,),))


def largest_travel(of):
    return max(float(np.ptp(record.recording.position.samples)) for record in of[0].full_measure.records)


@pytest.fixture(scope="module")
def rippled_search(hardening_context):
    """A ripple of little more than one pitch in the place of a cube."""
    pitch = 0.9 * largest_travel(hardening_context)
    return make_named_search(hardening_context, make_hypothesis("cogging", amplitude=0.2, pitch=pitch, phase=0.0))


def test_a_ripple_that_is_not_seen_twice_may_be_another_curve(hardening_context, rippled_search):
    assert may_approximate_law(hardening_context[0], rippled_search)
    short = make_named_search(
        hardening_context,
        make_hypothesis("cogging", amplitude=0.2, pitch=largest_travel(hardening_context) / 8, phase=0.0),
        fitted=False,
    )
    assert not may_approximate_law(hardening_context[0], short)


@pytest.mark.slow
def test_several_forces_on_one_axis_may_be_one_law_and_a_force_and_a_sensor_may_not(hardening_context):
    cube, drag = make_hypothesis("hardening_stiffness", k3=CUBIC), make_hypothesis("quadratic_damping", coefficient=0.1)
    assert may_approximate_law(hardening_context[0], make_named_search(hardening_context, cube, drag))
    assert not may_approximate_law(hardening_context[0], make_named_search(hardening_context, cube))
    assert not may_approximate_law(
        hardening_context[0], make_named_search(hardening_context, cube, make_hypothesis("sensor_gain", gain=1.01))
    )


@pytest.mark.slow
def test_an_exponent_that_was_rounded_counts_as_a_number(hardening_context):
    context, _ = hardening_context
    cube, drag = make_hypothesis("hardening_stiffness", k3=CUBIC), make_hypothesis("quadratic_damping", coefficient=0.1)
    two = make_named_search(hardening_context, cube, drag)
    found = discover_laws(context, two, ignore_progress, always, 1)
    assert len(found.explanation.after.fitted.hypothesis.parameters) < len(two.after.fitted.hypothesis.parameters) == 2
    assert not is_shorter_and_as_good(context, found, two.after)


@pytest.mark.slow
def test_the_shorter_law_takes_the_place_of_names_that_fit(hardening_context):
    context, _ = hardening_context
    cube, stop = (
        make_hypothesis("hardening_stiffness", k3=CUBIC),
        make_hypothesis("end_stop", position=1.0, stiffness=1e3, opposite=1.0),
    )
    names = make_named_search(hardening_context, cube, stop)
    assert judge(names).verdict == "explained"
    said = LawSearch(ignore_progress, always).add_laws(SearchResult(context, names, judge(names)))
    (found,) = list_fitted_laws(said.found.after.fitted.hypothesis)
    assert found.expression.endswith("x**3")
    assert found.numbers[0] == pytest.approx(-CUBIC, rel=0.02)
    assert said.judgement.verdict == "explained"


@pytest.mark.slow
def test_a_name_that_is_as_short_stays(hardening_context):
    context, _ = hardening_context
    cube = make_named_search(hardening_context, make_hypothesis("hardening_stiffness", k3=CUBIC))
    result = SearchResult(context, cube, judge(cube))
    assert LawSearch(ignore_progress, always).add_laws(result) is result
    found = discover_laws(context, cube, ignore_progress, always, 1)
    assert not is_shorter_and_as_good(context, found, cube.after)


@pytest.mark.slow
def test_a_law_whose_rivals_were_not_fitted_is_a_candidate(hardening_context):
    context, _ = hardening_context
    names = make_named_search(hardening_context, make_hypothesis("quadratic_damping", coefficient=0.1))
    found = discover_laws(context, names, ignore_progress, always)
    begun = replace(found, rounds=tuple(replace(each, complete=False) for each in found.rounds))
    for discovery, is_named in ((found, True), (begun, False)):
        said = check_laws(SearchResult(context, names, judge(names)), discovery, always)
        assert any(law is not None for law in list_fitted_laws(said.found.after.fitted.hypothesis)) == is_named
    assert any("time limit was reached" in each.why_not for each in said.unconfirmed)


@pytest.mark.slow
def test_a_search_whose_time_ends_within_a_fit_keeps_what_it_has(hardening_context):
    context, known = hardening_context
    kept = [
        discover_laws(context, known, ignore_progress, CountedBudget(questions))
        for questions in (1, 50, 80, 160, 100_000)
    ]
    assert kept[0] is None
    assert all(each.complete for each in kept[-1].rounds)
    cut = [found for found in kept[1:-1] if found is not None]
    assert cut
    assert any(not each.rounds[-1].complete for each in cut)
    assert all(each.explanation.after.fitted.cost < known.retuned.fitted.cost for each in cut)


def test_each_of_several_unconfirmed_laws_states_that_its_share_is_that_of_all(monkeypatch):
    monkeypatch.setattr("analysis.diagnosis.discovery.add_laws.estimate_held_out_gain", lambda *arguments: None)
    claims = [
        make_claim_hypothesis(Claim(make_law_effect(each), "one", (0,)), [get_law_values(each)])
        for each in (law("p0*x**3", 0.1), law("p0", 0.1))
    ]
    for hypothesis, is_stated in ((claims[0], False), (combine_hypotheses(*claims), True)):
        after = SimpleNamespace(fitted=SimpleNamespace(hypothesis=hypothesis))
        discovery = SimpleNamespace(explanation=SimpleNamespace(retuned=None, after=after))
        found = list(_yield_candidates(SimpleNamespace(full_measure=None), discovery, ("too weak",)))
        assert len(found) == len(hypothesis.claims)
        assert all(each.why_not.startswith("too weak") for each in found)
        assert all(("that of 2 laws together" in each.why_not) == is_stated for each in found)
