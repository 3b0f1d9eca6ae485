"""Dry friction that changes during a recording or between its parts is distinguished from a constant one."""

import re
from dataclasses import replace

import numpy as np
import pytest

from analysis.diagnosis.document import Estimate, NamedEffect
from analysis.diagnosis.result.plausibility import describe_changed_strengths

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
