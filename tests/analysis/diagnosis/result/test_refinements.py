"""A class holds what data cannot part; a law that only refines the named one is said in a sentence beside it."""

from dataclasses import replace

import pytest

from analysis.diagnosis.balance.judged_law import JudgedLaw
from analysis.diagnosis.balance.laws.law import Law
from analysis.diagnosis.document import Estimate, NamedEffect
from analysis.diagnosis.result.candidate_wording import format_class_noun
from analysis.diagnosis.result.candidates import _add_balance_results, is_refinement_of
from analysis.diagnosis.result.wording import describe_equivalents, describe_rivals

DRY = NamedEffect("coulomb_friction", "mechanism", "x", 0.9, 0.9, {"level": Estimate(0.2, "N")})


def make_judged_law(*alike: str) -> tuple[JudgedLaw, float]:
    law = Law.__new__(Law)
    return JudgedLaw(0, law, {}, 0.5, 0.4, 0.9, alike, 0.9, ""), 0.9


def test_refinements_leave_the_class_and_are_said_once():
    found = _add_balance_results(DRY, make_judged_law("stribeck_friction", "drifting_friction"))
    assert found.class_ == ()
    assert format_class_noun(found) == "dry friction"
    said = describe_equivalents(found)
    assert said.endswith("are refinements of this law and bring no gain on held-out data.") and said.count(".") == 1
    assert "Stribeck" in said and describe_rivals(found) == ()
    assert not any(rival.inseparable for rival in found.rivals)


def test_what_is_really_inseparable_stays():
    found = _add_balance_results(DRY, make_judged_law("viscous_damping", "asymmetric_friction"))
    assert found.class_ == ("coulomb_friction", "viscous_damping")
    assert [rival.effect for rival in found.rivals if rival.inseparable] == ["viscous_damping"]


def test_a_law_that_was_chosen_stays_in_the_class_of_what_is_played_for_it():
    law, share = make_judged_law("drifting_friction", "stribeck_friction")
    found = _add_balance_results(DRY, (replace(law, stands_for="drifting_friction"), share))
    assert found.class_ == ("coulomb_friction", "drifting_friction")


def test_the_plain_law_is_no_refinement_of_the_richer():
    rich = replace(DRY, effect="stribeck_friction", parameters={"coulomb": Estimate(0.2, "N")})
    assert _add_balance_results(rich, make_judged_law("coulomb_friction")).class_ == (
        "stribeck_friction",
        "coulomb_friction",
    )


@pytest.mark.parametrize("name", ["presliding_hysteresis", "position_dependent_friction", "drifting_friction"])
def test_which_hold_dry_friction(name):
    assert is_refinement_of(name, "coulomb_friction") and not is_refinement_of("coulomb_friction", name)
