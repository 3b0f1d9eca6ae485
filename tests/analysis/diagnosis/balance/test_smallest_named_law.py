"""A law whose share of the force is below the uncertainty of laboratory recordings is only a candidate, and so is a law
of many that are not all dry friction."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from analysis.diagnosis.balance.judge_laws import _find_objection

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
    why_not = _find_objection(law, {"level": 1.0}, (0.5, 0.4, 0.9, 0.95), alike)
    assert (why_not == "") == named
