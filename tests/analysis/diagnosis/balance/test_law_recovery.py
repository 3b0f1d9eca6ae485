"""One physical effect at a time in an axis is recovered from the force balance; intact axes name none."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.diagnosis.balance.laws.law import Scales
from analysis.diagnosis.balance.laws.motion_laws import make_dynamic_laws
from tests.slow_instances import slow_after

TRUTHS = {
    "coulomb_friction": {"coulomb": 1.0},
    "stribeck_friction": {"coulomb": 0.5, "stiction": 1.5, "stribeck_speed": 0.15},
    "presliding_hysteresis": {"dahl": 1.5, "dahl_stiffness": 300.0},
    "quadratic_damping": {"quadratic": 10.0},
    "hardening_stiffness": {"cubic": 3e4},
    "asymmetric_stiffness": {"square": 350.0},
    "cogging": {"cogging": 1.0, "pitch": 0.012, "phase": 0.7},
    "end_stop": {"stop_at": 0.04, "stop_stiffness": 800.0},
    "pose_dependent_inertia": {"inertia_per_m": 4.0},
    "position_dependent_friction": {"coulomb": 1.0, "rubbing_per_m": 8.0, "rubbing_per_m2": 50.0},
}
NUMBERS = {
    "coulomb_friction": {"level": (1.0, 0.05)},
    "stribeck_friction": {"coulomb": (0.5, 0.2), "static": (2.0, 0.1), "speed": (0.15, 0.15)},
    "presliding_hysteresis": {"level": (1.5, 0.05), "stiffness": (300.0, 0.05)},
    "quadratic_damping": {"coefficient": (10.0, 0.03)},
    "hardening_stiffness": {"k3": (3e4, 0.03)},
    "asymmetric_stiffness": {"k2": (350.0, 0.03)},
    "cogging": {"amplitude": (1.0, 0.05), "pitch": (0.012, 0.01)},
    "end_stop": {"position": (0.04, 0.02), "stiffness": (800.0, 0.1)},
    "pose_dependent_inertia": {"per_m": (4.0, 0.03)},
    "position_dependent_friction": {"level": (1.0, 0.05), "slope_per_m": (8.0, 0.1)},
}
PD = (600.0, 10.0)
BY_FEW_GRIPS = ("stribeck_friction", "position_dependent_friction")
"""In an open loop the axis sticks at each turn: they are then told from dry friction as a class alone."""
OPEN = ("coulomb_friction", "cogging", "end_stop")
CLOSED = ("hardening_stiffness",)
IMPOSED = ("stribeck_friction", "position_dependent_friction")


def check_balance(balance, effect, axis=0):
    found = {law.law.effect: law for law in balance.named}
    assert effect in found or any(effect in law.equivalents for law in balance.named)
    if effect in found:
        for name, (truth, within) in NUMBERS[effect].items():
            assert found[effect].values[name] == pytest.approx(truth, rel=within), name
    assert all(law.law.channel == axis for law in balance.named)
    assert balance.error < balance.linear_error


def check_open_loop(axis_module, find_balance, effect):
    (balance,) = find_balance(axis_module.record_axis(axis_module.Physics(**TRUTHS[effect])))
    check_balance(balance, effect)
    if effect not in BY_FEW_GRIPS:
        assert [law.law.effect for law in balance.named] == [effect]


def check_closed_loop(axis_module, find_balance, effect):
    (balance,) = find_balance(axis_module.record_axis(axis_module.Physics(**TRUTHS[effect]), gains=PD))
    check_balance(balance, effect)


def check_imposed_motion(axis_module, find_balance, effect):
    (balance,) = find_balance(axis_module.record_imposed_motion(axis_module.Physics(**TRUTHS[effect])))
    check_balance(balance, effect)
    if effect in IMPOSED:
        assert [law.law.effect for law in balance.named] == [effect]


@pytest.mark.parametrize("effect", slow_after(1, OPEN))
def test_in_an_open_loop(axis_module, find_balance, effect):
    check_open_loop(axis_module, find_balance, effect)


@pytest.mark.parametrize("effect", CLOSED)
def test_in_a_closed_loop(axis_module, find_balance, effect):
    check_closed_loop(axis_module, find_balance, effect)


@pytest.mark.parametrize("effect", slow_after(1, IMPOSED))
def test_where_the_motion_is_imposed_and_the_force_is_read(axis_module, find_balance, effect):
    check_imposed_motion(axis_module, find_balance, effect)


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_an_inertia_that_would_be_negative_within_the_travel_is_no_physics(side):
    low, high = sorted((-0.01 * side, 1.25 * side))
    scales = Scales(1.0, 1.26, low, high, 10.0, 20.0, turns_freely=False, rotational=False)
    (law,) = (law for law in make_dynamic_laws(0, scales) if law.effect == "pose_dependent_inertia")
    assert law.convert_weights(np.array([-0.09 * side]), (), 0.1) is None
    assert law.convert_weights(np.array([-0.07 * side]), (), 0.1) == pytest.approx(
        {"per_m": -0.7 * side, "speed_share": 0.5}
    )


def test_where_the_motion_is_imposed_no_law_of_an_actuator_is_tried(axis_module, find_balance):
    (balance,) = find_balance(axis_module.record_imposed_motion(axis_module.Physics(), seconds=6.0, rate_hz=250.0))
    assert "amplifier_lag" not in {law.effect for law in balance.search.regression.laws}


@pytest.mark.slow
@pytest.mark.parametrize("effect", [effect for effect in TRUTHS if effect not in OPEN])
def test_every_law_in_an_open_loop(axis_module, find_balance, effect):
    check_open_loop(axis_module, find_balance, effect)


@pytest.mark.slow
@pytest.mark.parametrize("effect", [effect for effect in TRUTHS if effect not in CLOSED])
def test_every_law_in_a_closed_loop(axis_module, find_balance, effect):
    check_closed_loop(axis_module, find_balance, effect)


@pytest.mark.slow
@pytest.mark.parametrize(
    "effect", [effect for effect in TRUTHS if effect not in (*IMPOSED, "presliding_hysteresis", "end_stop")]
)
def test_every_law_along_an_imposed_motion(axis_module, find_balance, effect):
    check_imposed_motion(axis_module, find_balance, effect)


@pytest.mark.slow
def test_a_stop_beyond_zero_is_named_with_its_side(axis_module, find_balance):
    recording = axis_module.record_axis(axis_module.Physics(**TRUTHS["end_stop"]))
    moved = replace(recording.response, samples=recording.response.samples - 0.06)
    (balance,) = find_balance(replace(recording, response=moved))
    (law,) = balance.named
    assert law.law.effect == "end_stop"
    assert law.values["side"] == 1
    assert law.values["position"] == pytest.approx(-0.02, abs=0.001)


@pytest.mark.slow
def test_of_two_axes_each_has_its_own(axis_module, find_balance):
    rubbing = axis_module.record_axis(axis_module.Physics(coulomb=1.0), seed=1)
    stiff = axis_module.record_axis(axis_module.Physics(cubic=3e4), seed=2)
    both = [np.hstack([getattr(each, side).samples for each in (rubbing, stiff)]) for side in ("command", "response")]
    first, second = find_balance(axis_module.make_recording(*both, rubbing.sample_rate_hz))
    check_balance(first, "coulomb_friction")
    check_balance(second, "hardening_stiffness", axis=1)


def effects_of_healthy_axis(axis_module, find_balance, seed, **beside):
    random = np.random.default_rng([seed, 11])
    physics = axis_module.Physics(
        random.uniform(0.1, 1.0), random.uniform(0.5, 5.0), random.uniform(30.0, 300.0), **beside
    )
    loop = PD if seed % 2 else None
    colour = (0.0, 0.9, 0.99)[seed % 3]
    recording = axis_module.record_axis(
        physics, seed, gains=loop, force_noise=(0.0, 0.01, 0.1)[seed // 2 % 3], colour=colour
    )
    (balance,) = find_balance(recording)
    return [law.law.effect for law in balance.named]


@pytest.mark.slow
@pytest.mark.parametrize("seed", [21, 22])
def test_where_nothing_is_missing_nothing_is_named(axis_module, find_balance, seed):
    assert effects_of_healthy_axis(axis_module, find_balance, seed) == []


@pytest.mark.slow
@pytest.mark.parametrize("seed", [24])
def test_a_second_linear_mode_gets_no_nonlinear_name(axis_module, find_balance, seed):
    assert effects_of_healthy_axis(axis_module, find_balance, seed, second_mass=0.1, second_hz=12.0) == []


@pytest.mark.slow
def test_nothing_is_named_in_thirty_healthy_axes(axis_module, find_balance):
    assert [seed for seed in range(30) if effects_of_healthy_axis(axis_module, find_balance, seed)] == []


@pytest.mark.slow
def test_nothing_is_named_in_thirty_axes_of_two_modes(axis_module, find_balance):
    assert [
        seed
        for seed in range(30)
        if effects_of_healthy_axis(axis_module, find_balance, seed, second_mass=0.1, second_hz=12.0)
    ] == []
