"""A short law is asked for before a second effect; two effects are not replaced by a sum of terms. Compiles."""

import pytest

from analysis.diagnosis.discovery.add_laws import LawSearch
from analysis.diagnosis.discovery.law_of_sum import laws_of
from analysis.diagnosis.search.search import Beyond, SearchResult, search_effects
from analysis.diagnosis.search.verdict import judge
from equalizer.effects.catalogue import EFFECTS
from tests.lawful import arena_of, law, recorded

CATALOGUE = [EFFECTS[name] for name in ("hardening_stiffness", "quadratic_damping", "constant_force", "sensor_gain")]
DRAG_15, CUBE = law("-p0*abs(vx)**1.5*sign(vx)", 0.6), law("-p0*x**3", 4e4)
DRAG_2 = law("-p0*abs(vx)*vx", 1.0)


def always():
    return True


def searched(recording, with_laws=True):
    said: list[str] = []

    def progress(what, share):
        said.append(what)

    laws = LawSearch(progress, always)
    beyond = Beyond(laws.add_short, laws.add_any) if with_laws else Beyond()
    result = search_effects(arena_of(recording)[0], CATALOGUE, progress, always, beyond)
    return result, said


def names_of(result):
    return {claim.effect.name for claim in result.found.after.fitted.hypothesis.claims}


def test_a_law_that_explains_ends_the_search_before_a_second_effect(seed=11):
    result, said = searched(recorded((DRAG_15,), seed))
    assert result.judgement.verdict == "explained"
    (found,) = laws_of(result.found.after.fitted.hypothesis)
    assert "abs(vx)**1.5" in found.expression
    assert "looking for the first effect" in said
    assert "looking for the second effect" not in said
    assert "looking for the second effect" in searched(recorded((DRAG_15,), seed), with_laws=False)[1]


def test_two_effects_keep_their_names(seed=12):
    """A sum of both terms is found before them, and is no shorter."""
    result, said = searched(recorded((CUBE, DRAG_2), seed))
    assert names_of(result) == {"hardening_stiffness", "quadratic_damping"}
    assert result.judgement.verdict == "explained"
    assert "looking for a law that has no name" in said


@pytest.mark.parametrize("seed", [13, 20])
def test_an_effect_that_fits_keeps_its_name(seed):
    """Of seed 13 the held-out samples leave enough to look for a law: it is the same formula, and no better."""
    result, said = searched(recorded((CUBE,), seed))
    assert names_of(result) == {"hardening_stiffness"}
    assert result.judgement.verdict == "explained"
    assert ("looking for a law that has no name" in said) == (seed == 13)


def test_the_same_samples_are_searched_for_laws_once(seed=14):
    said: list[str] = []
    context, known = arena_of(recorded((DRAG_15,), seed))
    laws = LawSearch(lambda what, share: said.append(what), always)
    once, again = (laws.add_any(SearchResult(context, known, judge(known))) for _ in range(2))
    assert said.count("looking for a law that has no name") == 1
    assert laws_of(once.found.after.fitted.hypothesis) == laws_of(again.found.after.fitted.hypothesis)


@pytest.mark.parametrize("hears", [True, False])
def test_out_of_time_over_a_pair_the_law_that_leaves_a_part_is_kept(hears, seed=15):
    """hears: whether a law was found before the time ended."""
    context, _ = arena_of(recorded((DRAG_15,), seed))
    asked: list[str] = []

    def short(result):
        asked.append("short")
        found = LawSearch(lambda what, share: None, always).add_short(result)
        named = type(found.judgement)("partly_explained", True)
        return SearchResult(context, found.found, named) if hears else result

    result = search_effects(context, CATALOGUE, lambda what, share: None, lambda: not asked, Beyond(short))
    assert ("discovered_law" in names_of(result)) == hears
