"""A law whose share of the force is below the uncertainty of laboratory recordings is only a candidate."""

from dataclasses import replace

import numpy as np
import pytest

SEED, RATE_HZ = 5, 250.0


@pytest.fixture(scope="module")
def balance(axes, balance_of):
    def found(share):
        given = axes.imposed(axes.Physics(), SEED, seconds=10.0, rate_hz=RATE_HZ)
        level = share * float(given.command.samples.std())
        rubbing = level * np.sign(np.gradient(given.response.samples, axis=0))
        return balance_of(replace(given, command=replace(given.command, samples=given.command.samples + rubbing)))[0]

    return found


def test_friction_of_a_hundredth_of_the_force_is_a_candidate(balance):
    found = balance(0.01)
    assert not found.named
    assert any("coulomb_friction" in (law.law.effect, *law.alike) for law in (*found.laws, *found.others))


def test_friction_of_a_tenth_of_the_force_is_named(balance):
    found = balance(0.1)
    assert any("coulomb_friction" in (law.law.effect, *law.alike) for law in found.named)
