"""Laws outside the catalogue in the force balance: invented laws are recovered with their exponents, on seeds that the
search was not developed on; nothing is named where nothing is missing, or where discovery is off."""

import numpy as np
import pytest
from numba import njit

from analysis.diagnosis.balance.laws.free_laws import FREE_LAWS
from analysis.diagnosis.diagnose_values import diagnose_values
from analysis.diagnosis.diagnosis_settings import DiagnosisSettings
from equalizer.laws.law import parse_law
from tests.analysis.diagnosis.balance.invented_axis import make_recording, random_course
from tests.slow_instances import slow, slow_rows

RATE_HZ, MASS_KG, DAMPING, STIFFNESS = 250.0, 0.3, 2.0, 100.0


@njit
def resist(kind, q, v):
    """The invented force at position q and velocity v, N."""
    if kind == 1:
        return 7.2 * np.sign(v) * abs(v) ** 1.5
    if kind == 2:
        return 6000.0 * q * q * v
    if kind == 3:
        return 0.3 * np.exp(q / 0.012)
    if kind == 4:
        return 12.0 * np.sign(v) * max(abs(v) - 0.2, 0.0)
    if kind == 5:
        return 0.004 / (q - 0.06) ** 2
    if kind == 6:
        return 6000.0 * q * q * v + 0.4 * np.tanh(v / 1e-3)
    if kind == 7:
        return 1.2 * np.tanh(v / 1e-3) + 1000.0 * q * q * v
    return 0.0


@njit
def move(kind, force, steps):
    """Positions (n,) of the axis, integrated in `steps` steps per sample."""
    dt, q, v = 1 / (steps * RATE_HZ), 0.0, 0.0
    position = np.zeros(len(force))
    for k in range(len(force)):
        position[k] = q
        for _ in range(steps):
            v += dt * (force[k] - DAMPING * v - STIFFNESS * q - resist(kind, q, v)) / MASS_KG
            q += dt * v
    return position


def record(kind, seed, seconds=30.0):
    force = 3.0 * random_course(seed, int(seconds * RATE_HZ), RATE_HZ, (0.2, 10.0))
    noise = 1e-6 * np.random.default_rng([seed, 9]).standard_normal(len(force))
    return make_recording(force[:, None], (move(kind, force, 20) + noise)[:, None], RATE_HZ)


def find_law(kind, seed, seconds):
    found = diagnose_values(record(kind, seed, seconds), settings=DiagnosisSettings(discovery=True)).diagnosis
    (effect,) = found.effects
    assert effect.effect == "discovered_law"
    assert effect.class_ == ()  # the internal names of free laws are no names of physics
    assert found.verdict == "partly_explained"  # without repeats the noise is unknown
    law = parse_law(effect.law.expression, effect.law.acts_on, effect.law.axis)
    return law.variables, law.numbers


@pytest.mark.parametrize(
    "kind, seed, seconds, variables, numbers",
    [
        (1, 21, 12.0, ("vx",), (7.2, 1.5)),
        *slow_rows(
            (1, 21, 30.0, ("vx",), (7.2, 1.5)),
            (2, 21, 30.0, ("vx", "x"), (6000.0,)),
            (3, 22, 30.0, ("x",), (0.3, 0.012)),
            (4, 22, 30.0, ("vx",), (12.0, 0.2)),
            (5, 21, 30.0, ("x",), (0.004, 0.06)),
        ),
    ],
)
def test_an_invented_law_is_recovered(kind, seed, seconds, variables, numbers):
    found_variables, found_numbers = find_law(kind, seed, seconds)
    assert found_variables == variables
    assert found_numbers[: len(numbers)] == pytest.approx(numbers, rel=0.05)


@pytest.mark.slow
def test_friction_is_named_in_addition_to_a_free_law(find_balance):
    balance = find_balance(record(6, 23))[0]
    named = {law.law.effect: law.formula and law.formula.text for law in balance.named}
    assert named == {"product_of_position_and_speed": "-p0*q**2*v", "coulomb_friction": None}


@pytest.mark.parametrize("seconds", [12.0, *slow(30.0)])
def test_no_formula_withdraws_the_name_of_friction(find_balance, seconds):
    balance = find_balance(record(7, 24, seconds))[0]
    assert "coulomb_friction" in {law.law.effect for law in balance.named}


@pytest.mark.parametrize(("seed", "seconds"), [(31, 12.0), *slow_rows((31, 30.0), (32, 30.0))])
def test_nothing_is_named_where_nothing_is_missing(find_balance, seed, seconds):
    assert not find_balance(record(0, seed, seconds))[0].named


@pytest.mark.slow
def test_a_friction_of_the_catalogue_keeps_its_name(find_balance, axis_module):
    balance = find_balance(axis_module.record_axis(axis_module.Physics(coulomb=1.0)))[0]
    assert {law.law.effect for law in balance.named} == {"coulomb_friction"}


def test_without_discovery_no_free_law_is_tried(find_balance):
    balance = find_balance(record(1, 21, seconds=8.0), without=FREE_LAWS)[0]
    assert {law.law.effect for law in balance.laws}.isdisjoint(FREE_LAWS)


@pytest.mark.slow
def test_without_discovery_no_formula_is_named():
    found = diagnose_values(record(1, 21), settings=DiagnosisSettings(discovery=False)).diagnosis
    assert all(effect.law is None for effect in found.effects)
