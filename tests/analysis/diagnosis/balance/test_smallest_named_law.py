"""A law whose share of the force is below the uncertainty of laboratory recordings is only a candidate, and so is a law
of many that are not all dry friction, or a minor one beside a main one that cannot be named."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from analysis.diagnosis.balance import balances
from analysis.diagnosis.balance.change_laws import append_laws
from analysis.diagnosis.balance.compare_free_laws import withdraw_names_of_surpassed_sum
from analysis.diagnosis.balance.judge_laws import _find_objection, judge_structure
from analysis.diagnosis.balance.laws.free_laws import FREE_LAWS
from analysis.diagnosis.balance.laws.law import Law, name_weights
from analysis.diagnosis.balance.motion import compute_motions
from analysis.diagnosis.balance.regression import build_regression
from analysis.diagnosis.balance.structures import Structure, StructureSearch
from analysis.diagnosis.data.observed_parts import observe_parts

SEED, RATE_HZ = 5, 250.0


@pytest.fixture(scope="module")
def find_friction_balance(axis_module, find_balance):
    def found(share):
        given = axis_module.record_imposed_motion(axis_module.Physics(), SEED, seconds=10.0, rate_hz=RATE_HZ)
        level = share * float(given.command.samples.std())
        rubbing = level * np.sign(np.gradient(given.response.samples, axis=0))
        return find_balance(replace(given, command=replace(given.command, samples=given.command.samples + rubbing)))[0]

    return found


@pytest.mark.slow
def test_friction_of_a_hundredth_of_the_force_is_a_candidate(find_friction_balance):
    found = find_friction_balance(0.01)
    assert not found.named
    assert any("coulomb_friction" in (law.law.effect, *law.equivalents) for law in (*found.laws, *found.further_laws))


def test_friction_of_a_tenth_of_the_force_is_named(find_friction_balance):
    found = find_friction_balance(0.1)
    assert any("coulomb_friction" in (law.law.effect, *law.equivalents) for law in found.named)


@pytest.mark.parametrize(
    ("effect", "alike", "named"),
    [
        ("presliding_hysteresis", ("stribeck_friction", "asymmetric_friction", "drifting_friction",
                                   "position_dependent_friction"), True),
        ("presliding_hysteresis", ("stribeck_friction", "asymmetric_friction", "drifting_friction",
                                   "quadratic_damping"), False),
        ("hardening_stiffness", ("asymmetric_stiffness", "end_stop"), True),
        ("hardening_stiffness", ("asymmetric_stiffness", "end_stop", "backlash", "gravity_torque"), False),
        ("coulomb_friction", ("cogging",), False),
    ],
)  # fmt: skip
def test_a_class_of_many_is_named_where_all_of_it_is_dry_friction(effect, alike, named):
    law = SimpleNamespace(is_linear=False, effect=effect, formula=None)
    why_not = _find_objection(law, {"level": 1.0}, (0.5, 0.4, 0.9), alike)
    assert (why_not == "") == named


def judge_two_laws(record_samples, main_effect):
    """Balance with dry friction and, with a fifth of its share, a hardening spring."""
    random, t = np.random.default_rng(1), np.arange(5000) / RATE_HZ
    position = sum(
        a * np.sin(2 * np.pi * f * t + p) for f, a, p in ((0.7, 0.5, 1.0), (2.3, 0.2, 2.0), (5.1, 0.05, 3.0))
    )
    speed = np.gradient(position) * RATE_HZ
    force = 3.0 * speed + 40 * position + 12 * np.tanh(speed) + 30 * position**3 + 0.3 * random.standard_normal(len(t))
    laws = (
        Law(main_effect, 0, (), lambda m, _: np.tanh(m.velocity[:, :1]), name_weights("level")),
        Law("hardening_stiffness", 0, (), lambda m, _: m.position[:, :1] ** 3, name_weights("k3")),
    )
    motions = compute_motions(observe_parts([record_samples(force[:, None], position[:, None], RATE_HZ)], 1))
    regression = build_regression(motions, 0, laws, turns_freely=False)
    linear, both = (Structure(k, regression.cross_validate(regression.select_columns(k))) for k in ((), (0, 1)))
    return judge_structure(StructureSearch(regression, linear, both, (both, linear), True), both)


@pytest.mark.parametrize(
    ("main_effect", "named"),
    [("coulomb_friction", {"coulomb_friction", "hardening_stiffness"}), ("not_in_the_catalogue", set())],
)
def test_a_minor_law_is_named_only_with_the_main_one(record_samples, main_effect, named):
    assert {law.law.effect for law in judge_two_laws(record_samples, main_effect).named} == named


@pytest.mark.parametrize(
    ("quantity", "share", "digits", "is_named"),
    [
        ("acceleration", 0.5, 9, False),
        ("acceleration", 0.5, 1, False),
        ("acceleration", 1.0, 1, True),
        ("position", 0.5, 1, True),
    ],
    ids=["clipped", "clipped by a converter", "intact", "at a stop"],
)
def test_no_law_is_named_from_the_cut_peaks_of_an_accelerometer(
    record_samples, monkeypatch, quantity, share, digits, is_named
):
    balance = judge_two_laws(record_samples, "coulomb_friction")
    monkeypatch.setattr(balances, "_fit_balances", lambda *_: (balance,))
    readings = np.round(np.random.default_rng(2).standard_normal((5000, 1)), digits)
    limit = share * np.abs(readings).max()
    recording = record_samples(readings, np.clip(readings, -limit, limit), RATE_HZ, quantity)
    (found,) = balances.find_balances([recording], FREE_LAWS, lambda: True)
    assert bool(found.named) == is_named
    assert any("stays at the limit of its sensor" in law.objection for law in found.laws) != is_named


@pytest.mark.parametrize(
    ("free_sum", "share", "is_named"),
    [((2,), 0.5, False), ((2,), 0.99, True), ((0, 2), 0.5, True)],
    ids=["a single law", "no better", "with another"],
)
def test_a_sum_of_unlike_laws_is_not_named_where_a_single_law_explains_more(record_samples, free_sum, share, is_named):
    balance = judge_two_laws(record_samples, "coulomb_friction")
    sums = [Structure(free_sum, share * balance.chosen.errors)]
    found = withdraw_names_of_surpassed_sum(balance, balance.search.regression, sums)
    assert len(found.named) == (2 if is_named else 0)


@pytest.mark.parametrize(
    ("free_law", "share", "is_named"),
    [
        ("product_of_position_and_speed", 0.5, False),
        ("product_of_position_and_speed", 0.99, True),
        ("power_of_speed", 0.5, True),
    ],
    ids=["of other arguments", "no better", "of the same argument"],
)
def test_a_law_is_not_named_where_one_of_other_arguments_explains_more(record_samples, free_law, share, is_named):
    """A friction that grows with the square of the position is no quadratic damping."""
    balance = judge_two_laws(record_samples, "coulomb_friction")
    friction_alone = replace(balance, laws=tuple(law for law in balance.laws if law.law.effect == "coulomb_friction"))
    made = Law(free_law, 0, (), lambda m, _: m.position[:, :1] ** 2 * np.sign(m.velocity[:, :1]), name_weights("p0"))
    regression = append_laws(balance.search.regression, [made])
    sums = [Structure((2,), share * balance.chosen.errors)]
    assert bool(withdraw_names_of_surpassed_sum(friction_alone, regression, sums).named) == is_named
