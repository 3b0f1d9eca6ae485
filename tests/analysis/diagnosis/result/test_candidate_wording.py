from dataclasses import replace

import pytest

from analysis.diagnosis.document import (
    Candidate,
    Diagnosis,
    Errors,
    Estimate,
    Fit,
    FoundLaw,
    Mismatch,
    NamedEffect,
    Rival,
)
from analysis.diagnosis.effect_words import EFFECT_WORDS, LAW_WORDS, get_noun, get_parameter_unit
from analysis.diagnosis.result.candidate_wording import (
    SENTENCE_COUNT,
    DeviceWording,
    describe_best_candidate,
    describe_candidates,
    describe_class,
    format_candidate,
)
from analysis.diagnosis.result.error_wording import describe_balance_errors
from analysis.diagnosis.result.findings import BalanceErrors
from analysis.diagnosis.result.wording import describe_equivalents, describe_verdict, format_effect_title
from equalizer.signals.unit_system import LINEAR, ROTATIONAL

ERRORS = Errors(0.5, 0.36, 0.36, 0.02)
DEVICE = DeviceWording(is_single_axis=True, system=LINEAR)
DRY = Candidate("coulomb_friction", "mechanism", "x", {"level": 0.211}, 0.4, 0.62, "the main part is another")
STICKY = Candidate(
    "viscoelastic_relaxation", "mechanism", "x", {"stiffness": 120.0, "time_constant": 0.02}, 0.2, 0.3,
    "hapteq cannot simulate it yet",
)  # fmt: skip
NAMED = NamedEffect("coulomb_friction", "mechanism", "x", 0.9, 0.68, {"level": Estimate(0.211, "N", (0.20, 0.22))})


def make_diagnosis(verdict, candidates, effects=()):
    place = Mismatch("ax", "fx", (8.0, 16.0), 0.5, None, 0.8, 1e-9)
    left = (place,) if verdict == "partly_explained" else ()
    fit = Fit(ERRORS, ERRORS)
    return Diagnosis(verdict, (place,), effects, {}, left, fit, "free simulation", None, candidates)


def effect_of_class(effect, *others, **changes):
    return replace(NAMED, effect=effect, class_=(effect, *others), **changes)


def test_where_nothing_is_named_the_verdict_says_the_best_candidate_with_its_numbers_and_why_not():
    said = describe_verdict(make_diagnosis("unexplained", (DRY, STICKY)), device=DEVICE)
    assert said.endswith(
        "Best candidate, not confirmed: dry friction on the x drive, 0.211 N. It would explain 40 % of the error's "
        "power on held-out data, 62 % of what all laws together explain. Reason not to name it: the main part is "
        "another."
    )


def test_no_candidate_is_said_to_be_best_where_something_is_named_or_nothing_is_there():
    assert "candidate" not in describe_verdict(make_diagnosis("unexplained", ()), device=DEVICE)
    assert describe_best_candidate(make_diagnosis("partly_explained", (DRY,), (NAMED,)), DEVICE) == ""


def test_each_candidate_is_said_once():
    nothing, something = (
        make_diagnosis("unexplained", (DRY, STICKY)),
        make_diagnosis("partly_explained", (STICKY,), (NAMED,)),
    )
    (other,) = describe_candidates(nothing, DEVICE)
    assert other.startswith("Not confirmed: viscoelastic relaxation of a spring on the x drive, ")
    assert "120 N/m, time constant 20.0 ms." in other
    assert describe_candidates(something, DEVICE) == (other,)


def test_sentences_are_few_however_many_candidates_there_are():
    many = tuple(replace(STICKY, effect=name) for name in ("cogging", "backlash", "end_stop", "constant_force"))
    assert len(describe_candidates(make_diagnosis("partly_explained", many, (NAMED,)), DEVICE)) == SENTENCE_COUNT


def test_numbers_have_units_only_where_the_device_is_known():
    assert format_candidate(DRY, DeviceWording(False, ROTATIONAL)) == "dry friction on the x drive, 211 mN m"
    assert format_candidate(DRY) == "dry friction on the x drive, level 0.211 (SI)"


def test_a_number_of_an_unknown_unit_of_the_reading_has_no_unit():
    nonlinear = replace(DRY, effect="sensor_nonlinearity", place="sensor", parameters={"cubic": 0.02})
    assert format_candidate(nonlinear, DEVICE) == "a nonlinear sensor in the x channel, cubic term 0.0200"


@pytest.mark.parametrize(
    ("effect", "parameters", "said"),
    [
        ("sensor_offset", {"offset": 0.5}, "a sensor offset in the x channel, 0.500 m/s²"),
        ("sensor_play", {"gap": 0.5}, "play before the sensor in the x channel, a gap of 0.500 m/s²"),
        ("sensor_gain", {"gain": 1.1}, "a wrong sensor gain in the x channel, a factor of 1.10"),
    ],
)
def test_a_number_of_a_sensor_has_the_unit_of_its_reading(effect, parameters, said):
    candidate = replace(DRY, effect=effect, place="sensor", parameters=parameters)
    assert format_candidate(candidate, replace(DEVICE, reading_units={"x": "m/s^2", "y": "m"})) == said


def test_a_law_is_a_candidate_with_its_formula():
    law = FoundLaw("-0.12*tanh(vx/0.001)", ("vx",), "force", "x")
    drag = replace(DRY, effect="discovered_law", parameters={"p0": -0.12, "p1": 0.001}, law=law)
    assert format_candidate(drag, DEVICE) == "discovered law on the x drive, F = -0.12*tanh(vx/0.001) N"
    assert format_candidate(drag) == "discovered law on the x drive, F = -0.12*tanh(vx/0.001)"


@pytest.mark.parametrize("effect", LAW_WORDS)
def test_laws_beyond_the_vocabulary_have_nouns_and_units(effect):
    assert "_" not in get_noun(effect)
    assert effect not in EFFECT_WORDS
    law = LAW_WORDS[effect]
    # The parameters of a sensor are in the unit of what it reads.
    numbers = set() if law.place == "sensor" else set(law.words.parameters) - set(law.words.shares)
    assert numbers == set(law.units)
    assert {get_parameter_unit(effect, name, system) for name in law.units for system in (LINEAR, ROTATIONAL)} != {"1"}


def test_a_class_is_called_by_what_its_laws_have_in_common():
    friction = effect_of_class("coulomb_friction", "stribeck_friction", "presliding_hysteresis")
    assert format_effect_title(friction, True) == "friction (dry friction, or 2 laws like it) on the x drive"
    assert describe_equivalents(friction) == (
        "Friction whose law these data do not determine: dry friction, friction that is larger at rest (Stribeck) or "
        "dry friction with elastic presliding would each explain it equally well on held-out data. The parameters "
        "are those of dry friction."
    )
    late = effect_of_class(
        "amplifier_lag", "transport_delay", place="actuator", parameters={"time_constant": Estimate(1e-3, "s")}
    )
    assert format_effect_title(late) == "a late command: lag or delay in the x actuator"


def test_a_class_of_different_kinds_and_rivals_as_good_are_listed():
    mixed = effect_of_class("coulomb_friction", "backlash", rivals=(Rival("stribeck_friction", 0.3, True, ""),))
    assert format_effect_title(mixed, True) == "dry friction on the x drive"
    assert "play (backlash) or friction that is larger at rest (Stribeck) would" in describe_class(mixed)


def test_an_effect_without_a_class_is_called_by_its_own_name():
    assert describe_class(NAMED) == describe_equivalents(NAMED) == ""
    assert format_effect_title(NAMED) == "dry friction on the x drive"


def test_the_share_of_the_reduction_by_all_laws_is_one_of_powers():
    (said,) = describe_balance_errors((BalanceErrors("x", 0.5, 0.3, 0.1, True),))
    assert "alone is 50 % of the force; with all laws together it is 10 %" in said
    assert said.endswith(
        "with the named laws it is 30 %, and that is 67 % of the reduction of the error power that all laws together "
        "reach."
    )
    (nothing,) = describe_balance_errors((BalanceErrors("x", 0.5, 0.5, 0.1, False),))
    assert nothing.endswith("no law is named.")
    (best,) = describe_balance_errors((BalanceErrors("x", 0.5, 0.1, 0.1, True),))
    assert best.endswith("with the named laws it is 10 %, and all laws together reach no smaller error.")
    assert describe_balance_errors((BalanceErrors("x", 0.5, 0.5, 0.1, False),) * 2)[0].startswith(
        "In the force balance along x,"
    )
