"""Figures of a proof from outcomes that are written by hand."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.diagnosis.document import Diagnosis, Errors, Estimate, Fit, Mismatch, NamedEffect, Rival
from analysis.evaluation.blind_test.calibration import compute_calibration
from analysis.evaluation.blind_test.confidence_intervals import compute_share, compute_statistic, pool_share
from analysis.evaluation.blind_test.detection import (
    classify_outcome,
    collect_effect_draws,
    compute_ideal_threshold,
    compute_rates_by_size,
)
from analysis.evaluation.blind_test.follow_up import FollowUp
from analysis.evaluation.blind_test.outcome import ConcealedEffect, Outcome
from analysis.evaluation.blind_test.score import compute_score, is_wrong_answer
from analysis.evaluation.blind_test.wording import describe_answer, describe_concealed, format_figure
from analysis.figures.blind_test_pictures import make_blind_test_pictures
from analysis.reports.blind_test_report import BlindTestMetadata, render_blind_test_report
from equalizer.plant.effect_vocabulary import EFFECTS_BY_NAME
from tests.slow_instances import slow_rows

CELL = Mismatch("ax", "fx", (1.0, 5.0), None, None, 0.5, 0.001)
ERRORS = Errors(0.5, 0.3, 0.1, 0.1)


def make_named_effect(effect, value=1.0, ci95=(0.9, 1.1), probability=0.9, inseparable=(), axis="x"):
    known = EFFECTS_BY_NAME[effect]
    rivals = tuple(Rival(name, 0.05, True, "as good") for name in inseparable)
    return NamedEffect(
        effect, known.place, axis, 0.9, probability, {known.main.name: Estimate(value, "1", ci95)}, rivals
    )


def make_diagnosis(verdict, *effects):
    remainder = (CELL,) if verdict == "partly_explained" else ()
    return Diagnosis(verdict, (CELL,), effects, {}, remainder, Fit(ERRORS, ERRORS), "free simulation", None)


def make_outcome(kind="single", concealed=("coulomb_friction",), answer=None, bank="main", retuned=5.0, **more):
    hidden = tuple(
        ConcealedEffect(
            name, getattr(EFFECTS_BY_NAME.get(name), "place", "mechanism"), "x", {"level": 1.0, "damping": 1.0}
        )
        for name in concealed
    )
    found = {"before": {"ax": 9.0}, "retuned": {"ax": retuned, "x": 1.0}, "after": {"ax": 1.05}}
    fixed = {
        "number": 0,
        "seed": 1,
        "axes": ("x", "y"),
        "model": "retuned",
        "strengths": (0.5,),
        "adds": 3.0,
        "seconds": 4.0,
    }
    return Outcome(kind=kind, bank=bank, concealed=hidden, diagnosis=answer, channel_errors=found, **(fixed | more))


RIGHT = make_outcome(answer=make_diagnosis("explained", make_named_effect("coulomb_friction")))
WRONG = make_outcome(answer=make_diagnosis("explained", make_named_effect("viscous_damping", probability=0.6)))
IN_SET = make_outcome(
    answer=make_diagnosis("explained", make_named_effect("viscous_damping", inseparable=("coulomb_friction",)))
)
UNSEEN = make_outcome(answer=make_diagnosis("parameters"), retuned=1.1, adds=1.0)
ALARM = make_outcome("nothing", (), make_diagnosis("explained", make_named_effect("cogging")), strengths=())
CLEAN = make_outcome("nothing", (), make_diagnosis("parameters"), strengths=())
OUTSIDE = make_outcome("outside", ("creep",), make_diagnosis("unexplained"))
TAKEN_IN = make_outcome("outside", ("creep",), make_diagnosis("explained", make_named_effect("cogging")))
WITHOUT = make_outcome("without", answer=make_diagnosis("unexplained"))
PAIR = make_outcome(
    "pair",
    ("coulomb_friction", "viscous_damping"),
    make_diagnosis("partly_explained", make_named_effect("coulomb_friction")),
    strengths=(1, 1),
)
BROKEN = make_outcome()
GUESSED = make_outcome(answer=make_diagnosis("explained", make_named_effect("cogging")), retuned=1.1, adds=0.4)
PARTLY = make_outcome("without", answer=make_diagnosis("partly_explained", make_named_effect("stribeck_friction")))
ALL = (RIGHT, WRONG, IN_SET, UNSEEN, GUESSED, ALARM, CLEAN, OUTSIDE, TAKEN_IN, WITHOUT, PARTLY, PAIR, BROKEN)


def find_figure(outcomes, name):
    return next(each for each in compute_score(outcomes).figures if each.name == name)


@pytest.mark.parametrize(
    ("name", "hits", "of"),
    [
        ("nothing missing, yet named", 1, 2),
        ("without the true effect, yet explained", 0, 2),
        ("pairs, both and no other", 0, 1),
        ("true value in the 95 % interval", 1, 1),
        ("without the true effect, any name", 1, 2),
        *slow_rows(
            ("named right", 1, 4),
            ("in the returned set", 2, 4),
            ("right where one name is returned", 1, 2),
            ("outside the catalogue, not explained", 1, 2),
            ("pairs, at least one", 1, 1),
            ("single effects that count as detectable", 4, 6),
            ("named right, of those that an oracle sees", 1, 5),
            ("not detectable, yet a wrong name", 1, 2),
        ),
    ],
)
def test_shares_count_what_their_names_say(name, hits, of):
    found = find_figure(ALL, name)
    assert (found.hits, found.of) == (hits, of)


def test_every_answer_that_is_not_as_it_should_be_is_listed():
    assert {id(miss) for miss in compute_score(ALL).misses} == {
        id(o) for o in (WRONG, IN_SET, GUESSED, ALARM, TAKEN_IN, PARTLY, PAIR, BROKEN)
    }


def test_a_channel_of_unknown_error_hides_no_other():
    for errors in ({"x": float("nan"), "ax": 5.0}, {"ax": 5.0, "x": float("nan")}):
        case = replace(UNSEEN, channel_errors={"retuned": errors})
        assert (case.compute_worst_error("retuned"), case.detectable, is_wrong_answer(case)) == (5.0, True, True)


def test_what_cannot_be_seen_is_no_miss_and_what_broke_down_is_one():
    assert not is_wrong_answer(UNSEEN)
    assert is_wrong_answer(BROKEN)


def test_a_right_name_on_another_axis_is_a_miss_where_there_are_several():
    there = make_diagnosis("explained", make_named_effect("coulomb_friction", axis="y"))
    assert is_wrong_answer(make_outcome(answer=there))
    assert not is_wrong_answer(make_outcome(answer=there, axes=("x",)))
    assert not is_wrong_answer(
        make_outcome(answer=make_diagnosis("explained", make_named_effect("coulomb_friction", axis=None)))
    )


def test_what_hangs_together_is_resampled_together():
    whole = [[True] * 10, [False] * 10] * 10
    found, alone = (
        pool_share("together", whole),
        compute_share("alone", [each for group in whole for each in group], bool),
    )
    assert found.value == alone.value == 0.5
    assert found.high - found.low > 2 * (alone.high - alone.low)
    assert pool_share("none", [[], []]).value is None


def test_shares_of_nothing_have_no_value():
    assert compute_share("none", [], bool).value is None
    assert format_figure(compute_share("none", [], bool)) == "none drawn"
    assert compute_statistic("none", [], np.median).value is None


def test_an_interval_holds_its_share():
    found = compute_share("half", [True, False] * 50, bool)
    assert found.low < 0.5 < found.high
    assert format_figure(found).startswith("50.0 % [40, 60]")


@pytest.mark.slow
def test_probabilities_that_mean_what_they_say_have_no_error():
    honest = [
        make_outcome(answer=make_diagnosis("explained", make_named_effect("coulomb_friction", probability=0.75)))
    ] * 30
    honest += [make_outcome(answer=make_diagnosis("explained", make_named_effect("cogging", probability=0.75)))] * 10
    mixed = [honest[k] for k in np.random.default_rng(1).permutation(40)]
    assert compute_calibration(mixed).error == pytest.approx(0.0, abs=1e-12)  # in any order of the ties
    boasting = compute_calibration([WRONG] * 20)
    assert boasting.error == pytest.approx(0.6)
    assert len(boasting.bins) == 10


def test_each_draw_becomes_a_mark_of_its_effect():
    strips = collect_effect_draws([RIGHT, WRONG, IN_SET, UNSEEN])
    assert [strip.effect for strip in strips] == ["coulomb_friction"]
    assert sorted(how for _, how in strips[0].draws) == ["in the set", "invisible", "missed", "right"]
    assert classify_outcome(BROKEN) == "missed"


def test_an_ideal_observer_sees_an_effect_from_where_it_adds_three_quarters_of_the_noise():
    drawn = [make_outcome(adds=0.075 * 100**strength, strengths=(strength,)) for strength in (0.0, 0.2, 0.7, 1.0)]
    assert compute_ideal_threshold(drawn) == pytest.approx(0.5)
    assert (
        compute_ideal_threshold([make_outcome(adds=9.0, strengths=(s,)) for s in (0.0, 0.5, 1.0)]) is None
    )  # it does not grow
    assert compute_ideal_threshold(drawn[:2]) is None
    assert collect_effect_draws(drawn)[0].ideal_threshold == pytest.approx(0.5)


def test_larger_effects_come_later():
    drawn = [make_outcome(answer=make_diagnosis("parameters"), adds=float(k), retuned=1.0) for k in range(40)]
    sizes = [part.median_change for part in compute_rates_by_size(drawn)]
    assert sizes == sorted(sizes) and len(sizes) == 10


def test_the_page_lists_misses_before_figures_and_shows_all_pictures():
    whole = compute_score(ALL)
    pictures = make_blind_test_pictures(ALL, whole.calibration)
    assert [picture.name for picture in pictures] == ["detection", "detection-by-size", "confusion", "reliability"]
    both = ("sensor_lag", "logger_offset")
    followed = (
        FollowUp(5, "sensor_lag", both, "a sweep from 1 to 450 Hz", ("sensor_lag",), "a slow sinusoid", both),
        FollowUp(6, "sensor_lag", both, "", (), "a slow sinusoid", ()),
    )
    facts = BlindTestMetadata("1 to 11", "ab" * 32, "c0ffee", ("d1",), ("One remark.",), (), followed)
    page = render_blind_test_report(ALL, whole, pictures, facts, {}, "2026-01-01T00:00:00Z")
    assert page.index("Misses: 8") < page.index("Figures")
    assert "One remark." in page and "ab" * 32 in page
    assert "sensor_lag, logger_offset" in page and "no recording would decide" in page and "no name" in page


def test_a_bank_of_nothing_has_no_pictures():
    assert make_blind_test_pictures([CLEAN], compute_calibration([CLEAN])) == ()


def test_sentences_say_truth_and_answer():
    assert describe_concealed(PAIR) == "coulomb_friction of x + viscous_damping of x"
    assert describe_answer(WRONG) == "explained: viscous_damping of x (0.60)"
    assert describe_concealed(CLEAN) == "nothing"
