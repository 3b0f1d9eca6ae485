"""Dry friction that changes during a recording is named as friction and distinguished from a constant one."""

from dataclasses import replace

import numpy as np
import pytest

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
