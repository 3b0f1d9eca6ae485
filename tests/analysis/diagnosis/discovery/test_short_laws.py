"""A short law is asked for before a second effect; two effects are not replaced by a sum of terms. Compiles."""

from dataclasses import replace

import pytest

import analysis.diagnosis.discovery.discover as discover_module
from analysis.diagnosis.discovery.add_laws import LawSearch, is_short_description
from analysis.diagnosis.discovery.convert_sum import list_fitted_laws
from analysis.diagnosis.discovery.discover import Discovery, Round
from analysis.diagnosis.discovery.fit_sum import Sum
from analysis.diagnosis.discovery.grammar import Term
from analysis.diagnosis.limits import LAW_ALONE_REMAINDER
from analysis.diagnosis.search.guard import Guard
from analysis.diagnosis.search.search import FurtherSearches, search_effects
from analysis.diagnosis.search.time_budget import OUT_OF_TIME
from analysis.diagnosis.search.verdict import Judgement, SearchResult, judge
from equalizer.effects.catalogue import EFFECTS
from tests.lawful import arena_of, law, recorded

CATALOGUE = [EFFECTS[name] for name in ("hardening_stiffness", "quadratic_damping", "constant_force", "sensor_gain")]
DRAG_15, CUBE = law("-p0*abs(vx)**1.5*sign(vx)", 0.6), law("-p0*x**3", 4e4)
DRAG_2 = law("-p0*abs(vx)*vx", 1.0)


def always():
    return True


def search_laws(recording, with_laws=True):
    said: list[str] = []

    def progress(what, share):
        said.append(what)

    laws = LawSearch(progress, always)
    beyond = FurtherSearches(laws.add_short_laws, at_end=laws.add_laws) if with_laws else FurtherSearches()
    result = search_effects(arena_of(recording)[0], CATALOGUE, progress, always, beyond)
    return result, said


def effect_names(result):
    return {claim.effect.name for claim in result.found.after.fitted.hypothesis.claims}


@pytest.mark.slow
def test_a_law_that_explains_ends_the_search_before_a_second_effect(seed=11):
    result, said = search_laws(recorded((DRAG_15,), seed))
    assert result.judgement.verdict == "explained"
    (found,) = list_fitted_laws(result.found.after.fitted.hypothesis)
    assert "abs(vx)**1.5" in found.expression
    assert "looking for the first effect" in said
    assert "looking for the second effect" not in said
    assert "looking for the second effect" in search_laws(recorded((DRAG_15,), seed), with_laws=False)[1]


@pytest.mark.slow
def test_two_effects_keep_their_names(seed=12):
    """Laws are asked for before the second; a sum of both terms would be no shorter."""
    result, said = search_laws(recorded((CUBE, DRAG_2), seed))
    assert effect_names(result) == {"hardening_stiffness", "quadratic_damping"}
    assert result.judgement.verdict == "explained"
    assert "looking for a law outside the catalogue" in said


@pytest.mark.slow
@pytest.mark.parametrize("seed", [13, 20])
def test_an_effect_that_fits_keeps_its_name(seed):
    """Of seed 13 the held-out samples leave enough to look for a law: it is the same formula, and no better."""
    result, said = search_laws(recorded((CUBE,), seed))
    assert effect_names(result) == {"hardening_stiffness"}
    assert result.judgement.verdict == "explained"
    assert ("looking for a law outside the catalogue" in said) == (seed == 13)


@pytest.mark.slow
def test_the_same_samples_are_searched_for_laws_once(seed=14):
    said: list[str] = []
    context, known = arena_of(recorded((DRAG_15,), seed))
    laws = LawSearch(lambda what, share: said.append(what), always)
    once, again = (laws.add_laws(SearchResult(context, known, judge(known))) for _ in range(2))
    assert said.count("looking for a law outside the catalogue") == 1
    assert list_fitted_laws(once.found.after.fitted.hypothesis) == list_fitted_laws(again.found.after.fitted.hypothesis)


@pytest.mark.slow
@pytest.mark.parametrize("hears", [True, False])
def test_out_of_time_over_a_pair_the_law_that_leaves_a_part_is_kept(hears, seed=15):
    """hears: whether a law was found before the time ended."""
    context, _ = arena_of(recorded((DRAG_15,), seed))
    asked: list[str] = []

    def short(result):
        asked.append("short")
        found = LawSearch(lambda what, share: None, always).add_short_laws(result)
        named = Judgement("partly_explained", True)
        return SearchResult(context, found.found, named) if hears else result

    result = search_effects(context, CATALOGUE, lambda what, share: None, lambda: not asked, FurtherSearches(short))
    assert ("discovered_law" in effect_names(result)) == hears
    assert OUT_OF_TIME in result.remarks


@pytest.mark.slow
def test_a_law_that_leaves_a_part_gives_way_to_names_that_explain(seed=12):
    """Of a device with two effects, an early answer that holds the first one alone is not kept."""
    context, _ = arena_of(recorded((CUBE, DRAG_2), seed))

    def short(result):
        return replace(result, judgement=Judgement("partly_explained", True))

    result = search_effects(context, CATALOGUE, lambda what, share: None, always, FurtherSearches(short))
    assert effect_names(result) == {"hardening_stiffness", "quadratic_damping"}


@pytest.mark.slow
def test_a_short_law_is_found_once_for_both_questions(seed=11):
    said: list[str] = []
    context, known = arena_of(recorded((DRAG_15,), seed))
    laws = LawSearch(lambda what, share: said.append(what), always)
    result = SearchResult(context, known, judge(known))
    assert laws.add_short_laws(result).judgement.verdict == laws.add_laws(result).judgement.verdict == "explained"
    assert said.count("looking for a law outside the catalogue") == 1


@pytest.mark.parametrize(
    ("leaves", "begun"), [pytest.param(1e-4, False, marks=pytest.mark.slow), (LAW_ALONE_REMAINDER, True)]
)
def test_a_screen_that_leaves_too_much_costs_no_fit(monkeypatch, leaves, begun, seed=12):
    """Of two effects, a single term leaves a part of the missing force."""
    fits: list[object] = []

    def fit_sums(*arguments):
        fits.append(arguments)
        return ()

    monkeypatch.setattr(discover_module, "LAW_ALONE_REMAINDER", leaves)
    monkeypatch.setattr(discover_module, "fit_sums", fit_sums)
    context, known = arena_of(recorded((CUBE, DRAG_2), seed))
    assert discover_module.discover_laws(context, known, lambda what, share: None, always, single_term=True) is None
    assert bool(fits) == begun


def make_discovery(*sums):
    return Discovery(None, tuple(Round((), (each,), 0.0) for each in sums))


def make_sum(axis, *shapes, partner=None):
    terms = tuple(Term(shape) for shape in shapes)
    return Sum(axis, terms, (1.0,) * len(terms), 1.0, 9.0, 0.0, (), partner=partner)


@pytest.mark.parametrize(
    ("sums", "short"),
    [
        ((make_sum(0, "abs(vx)*vx"),), True),
        ((make_sum(0, "abs(vx)*vx", "x**3"),), False),
        ((make_sum(0, "sqrt(vx**2 + vy**2)*vx"), make_sum(1, "sqrt(vx**2 + vy**2)*vy")), True),
        ((make_sum(0, "abs(vx)*vx"), make_sum(1, "abs(vy)*vy")), False),
        ((make_sum(0, "vx*sin(t)"), make_sum(1, "vy*sin(t)")), False),
        ((make_sum(0, "vy", partner=make_sum(1, "vx")),), True),
        ((make_sum(0, "vx*y"), make_sum(0, "x*vy")), False),
    ],
)
def test_short_is_one_term_or_one_on_each_axis_that_depends_on_another(sums, short):
    assert is_short_description(make_discovery(*sums)) is short


@pytest.mark.slow
def test_a_law_search_that_crashes_keeps_what_the_catalogue_names(seed=12):
    def crashes(result):
        raise ValueError("operands could not be broadcast together")

    context, _ = arena_of(recorded((CUBE, DRAG_2), seed))
    guarded = replace(context, guard=Guard(enabled=True))
    searches = FurtherSearches(crashes, at_end=crashes)
    result = search_effects(guarded, CATALOGUE, lambda what, share: None, always, searches)
    assert effect_names(result) == {"hardening_stiffness", "quadratic_damping"}
    (said,) = guarded.guard.sentences
    assert said.startswith("A law outside the catalogue was left out")
    with pytest.raises(ValueError, match="broadcast"):
        search_effects(context, CATALOGUE, lambda what, share: None, always, FurtherSearches(crashes))
