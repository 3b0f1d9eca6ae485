"""Dry friction that changes during a recording or between its parts is distinguished from a constant one."""

import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from analysis.diagnosis.balance.judged_law import NO_COLUMN
from analysis.diagnosis.balance.laws.law import Scales
from analysis.diagnosis.balance.laws.motion_laws import make_dynamic_laws, make_stiffness_laws
from analysis.diagnosis.document import Estimate, NamedEffect
from analysis.diagnosis.result.plausibility import _find_strength, _list_parts, describe_changed_strengths

SEED, LEVEL, RATE_HZ = 3, 2.0, 250.0


@pytest.fixture(scope="module")
def find_drifting_balance(axis_module, find_balance):
    def found(change):
        given = axis_module.record_imposed_motion(axis_module.Physics(), SEED, seconds=10.0, rate_hz=RATE_HZ)
        time = np.linspace(-1.0, 1.0, len(given))[:, None]
        rubbing = LEVEL * (1 + change * time) * np.sign(np.gradient(given.response.samples, axis=0))
        return find_balance(replace(given, command=replace(given.command, samples=given.command.samples + rubbing)))[0]

    return found


def test_friction_that_grows_ninefold_is_named_in_a_class_with_its_drift(find_drifting_balance):
    law = find_drifting_balance(0.8).named[0]
    assert law.law.effect == "coulomb_friction"
    assert "drifting_friction" in law.equivalents
    assert law.values["level"] == pytest.approx(LEVEL, rel=0.1)
    assert law.values["change"] == pytest.approx(0.8 * LEVEL, rel=0.1)


@pytest.mark.slow
def test_constant_friction_is_not_said_to_drift(find_drifting_balance):
    law = find_drifting_balance(0.0).named[0]
    assert law.law.effect == "coulomb_friction"
    assert "change" not in law.values


@pytest.mark.parametrize("levels", [(0.5, 1.0, 2.0, 3.0, 4.0), (2.0,) * 5])
def test_friction_that_differs_between_parts_is_told_part_by_part(axis_module, find_balance, levels):
    given = axis_module.record_imposed_motion(axis_module.Physics(), SEED, seconds=20.0, rate_hz=RATE_HZ)
    count = len(given) // len(levels)
    rubbing = np.repeat(levels, count)[:, None] * np.sign(np.gradient(given.response.samples, axis=0))
    parts = [{"start": count * index, "stop": count * (index + 1)} for index in range(len(levels))]
    balances = find_balance(
        replace(
            given,
            command=replace(given.command, samples=given.command.samples + rubbing),
            meta={**given.meta, "parts": parts},
        )
    )
    (law,) = balances[0].named
    effect = NamedEffect(law.law.effect, "mechanism", None, 0.9, 0.9, {"level": Estimate(law.values["level"], "N")})
    sentences = describe_changed_strengths((effect,), balances, ("fx",))
    if len(set(levels)) == 1:
        assert sentences == ()
    else:
        found = [float(number) for number in re.findall(r"([\d.]+) N", sentences[0])]
        np.testing.assert_allclose(found, levels, rtol=0.05)

    # A law of the command has no column, and no strength in the force balance.
    of_command = replace(balances[0], laws=(replace(law, law_index=NO_COLUMN),))
    assert describe_changed_strengths((effect,), (of_command,), ("fx",)) == ()


@pytest.mark.parametrize(
    ("effect", "strength"),
    [
        ("end_stop", "stiffness"),
        ("backlash", "contact_stiffness"),
        ("extra_mode", "mass"),
        ("hardening_stiffness", "k3"),
        ("pose_dependent_inertia", "per_m"),
    ],
)
def test_the_strength_of_a_law_is_the_parameter_that_grows_with_its_force(effect, strength):
    """Not where a stop stands, how wide a gap is or how fast a mode is, which a fitted weight does not give."""
    scales = Scales(1.0, 0.1, -0.04, 0.06, 10.0, 20.0, turns_freely=False, rotational=False)
    law = next(e for make in (make_stiffness_laws, make_dynamic_laws) for e in make(0, scales) if e.effect == effect)
    weights = np.array([0.4, 6.0, 900.0, 0.0, 2.0])
    regression = SimpleNamespace(
        mass=None,
        base_terms=SimpleNamespace(driven_channel=0),
        select_columns=lambda laws: list(range(len(weights))),
        fit_weights=lambda columns: weights,
    )
    judged = SimpleNamespace(law_index=7, law=law, formula=None)
    parameters = dict.fromkeys(law.convert_weights(weights[-1:], law.numbers, 0.4), Estimate(1.0, "1"))
    named = NamedEffect(effect, "mechanism", None, 0.9, 0.9, parameters)
    assert _find_strength(named, judged, regression) == strength
    assert _find_strength(named, SimpleNamespace(law=law, formula="f"), regression) == ""


def test_parts_in_which_a_law_hardly_acts_have_no_strength():
    """As where an end stop is not reached: a weight fitted there would be that of noise."""

    def block(part, power):
        return SimpleNamespace(motion_index=part, gram=np.diag([1.0, power]), rows=np.arange(10))

    fit = [block(part, power) for part, power in enumerate((5.0, 0.06, 0.04, 0.0, 7.0)) for _ in range(part + 1)]
    test = [block(part, 1.0) for part in (0, 1, 2, 3, 5)]
    assert _list_parts(SimpleNamespace(fit=fit, test=test), 1) == [0, 1]
