"""The second physics engine: it agrees with the first where both know the physics, and cases of it are whole."""

from dataclasses import replace

import numpy as np
import pytest

from study.evaluation.challenge.bench import draw_bench
from study.evaluation.challenge.case_settings import CaseSettings
from study.evaluation.challenge.concealed_effect import EffectContext
from study.evaluation.challenge.device import Device
from study.evaluation.challenge.device import simulate_motion as simulate_bench_motion
from study.evaluation.challenge.draw_case import EFFECTS
from study.evaluation.challenge.drive_plan import draw_multisine
from study.evaluation.challenge.second_engine import mujoco_access
from study.evaluation.challenge.sensor import NOISE_MPS2

pytest.importorskip("mujoco", reason="the extra `prove` (MuJoCo) is not installed")

ALONG_X = {
    "coulomb_friction": 3.0, "viscous_damping": 0.7, "added_mass": 0.7, "end_stop": 1.0, "hand_impedance": 0.7,
    "force_saturation": 0.7, "transport_delay": 0.7, "extra_mode": 0.7, "amplifier_lag": 1.5,
}  # fmt: skip
"""Most by which the engines may differ, in units of the accelerometer's noise."""


@pytest.fixture(scope="module")
def bench():
    from study.evaluation.challenge.second_engine.mujoco_bench import make_baseline_bench

    return make_baseline_bench(draw_bench(np.random.default_rng(50_021)))


@pytest.fixture(scope="module")
def command():
    wave = np.zeros((1500, 3))
    wave[:1000, 0] = draw_multisine(np.random.default_rng(50_022), 3.0, 1000)
    return wave


def apart(one, other):
    return float(np.sqrt(np.mean((one[0][:, 0] - other[0][:, 0]) ** 2)) / NOISE_MPS2[0])


@pytest.mark.parametrize("name", ALONG_X)
def test_both_engines_know_the_same_physics(name, bench, command):
    from study.evaluation.challenge.second_engine.mujoco_bench import linearise, simulate_motion
    from study.evaluation.challenge.second_engine.mujoco_case import BUILDERS

    free, first = simulate_motion(bench, command), Device(linearise(bench))
    travel, peak = np.abs(free[1]).max(axis=0), np.abs(free[0]).max(axis=0)
    values = EFFECTS[name].draw(EffectContext(np.random.default_rng(5), 0.8, linearise(bench), 0, travel, peak, (0,)))
    with_it = BUILDERS[name](bench, 0, values)
    if name == "transport_delay":
        values = {"delay": with_it.delay_s}
    seen = simulate_motion(with_it, command)
    assert apart(seen, simulate_bench_motion(EFFECTS[name].build(first, 0, values), command)) < ALONG_X[name]
    assert apart(seen, free) > 2 * ALONG_X[name]


def test_a_contact_gives_way_as_much_as_its_spring_says(bench):
    from study.evaluation.challenge.second_engine.mujoco_bench import simulate_motion

    play = {"gap": 1e-4, "motor_mass": 0.06, "contact_stiffness": 3e5, "contact_damping": 20.0}
    pushed = np.tile([1.0, 0.0, 0.0], (3000, 1))
    held = simulate_motion(replace(bench, play=(0, play)), pushed)[1][-1, 0]
    assert held == pytest.approx(1.0 / bench.stiffness[0], rel=2e-3)


def test_a_case_holds_what_it_says_and_is_the_same_again():
    drawn = [
        mujoco_access.draw_engine_case(50_023, ("sensor_gain",), "calibrated", (0.9,), "a", CaseSettings((1,), 1000, 3))
        for _ in range(2)
    ]
    assert drawn[0].truth == drawn[1].truth
    assert drawn[0].truth[0].axis == "y"
    assert np.array_equal(drawn[0].recording.response.samples, drawn[1].recording.response.samples)
    assert drawn[0].detectability > 1.0


def test_what_the_engine_cannot_express_is_refused():
    with pytest.raises(ValueError, match="cannot conceal cogging"):
        mujoco_access.draw_engine_case(1, ("cogging",), "calibrated", (0.5,), "a", CaseSettings((0,), 1000, 3))


def test_every_effect_of_its_list_can_be_built():
    from study.evaluation.challenge.second_engine.mujoco_case import BUILDERS, SENSOR_EFFECTS

    assert set(mujoco_access.MUJOCO_EFFECTS) == {*BUILDERS, *SENSOR_EFFECTS}
