import numpy as np
import pytest

from study.devices.rig import ACCELERATION, POSITION, READING_SIZE, SENSOR_CLIPPED, TRUE_ACCELERATION
from study.devices.simulated.layout import FILTERED_ACCELERATION, MOTOR_ANGLE
from study.devices.simulated.omega3 import build_omega3
from study.devices.simulated.parameters import GRAVITY_MPS2, Accelerometer

REST = np.zeros((4000, 3))


def one_reading(rig):
    reading = np.empty(READING_SIZE)
    rig.sense(rig.state, rig.parameters, rig.noise, reading)
    return reading


def quiet(rig):
    rig.parameters[-4:-1] = 0.0
    return rig


def test_the_noise_at_rest_is_the_data_sheets_density_over_the_filter(bench):
    rows = bench.play(build_omega3(3, hand=False), REST)[:, ACCELERATION]
    assert rows.std(axis=0) == pytest.approx([0.0412, 0.0412, 0.0825], rel=0.04)
    assert rows.mean(axis=0) == pytest.approx(np.zeros(3), abs=0.005)


def test_the_same_seed_reads_the_same_and_another_seed_does_not(bench):
    first, again, other = (bench.play(build_omega3(seed, hand=False), REST) for seed in (1, 1, 2))
    assert np.array_equal(first, again)
    assert not np.any(first[:, ACCELERATION] == other[:, ACCELERATION])
    assert np.array_equal(first[:, POSITION], other[:, POSITION])


@pytest.mark.parametrize(("axis", "sign"), [(0, 1), (0, -1), (1, 1), (2, 1), (2, -1)])
def test_three_g_with_gravity_in_it_is_the_limit_and_sets_the_flag(axis, sign):
    rig = quiet(build_omega3(1, hand=False))
    room = 3 * GRAVITY_MPS2 - sign * GRAVITY_MPS2 * (axis == 2)
    rig.state[FILTERED_ACCELERATION + axis] = sign * 0.95 * room
    assert one_reading(rig)[SENSOR_CLIPPED] == 0
    rig.state[FILTERED_ACCELERATION + axis] = sign * 1.05 * room
    reading = one_reading(rig)
    assert reading[SENSOR_CLIPPED] == 1
    assert reading[ACCELERATION][axis] == pytest.approx(sign * room, rel=0.02)


def test_the_encoders_step_and_the_step_is_below_ten_micrometres_along_a_leg():
    rig = build_omega3(1, hand=False)
    at_rest = one_reading(rig)[POSITION].copy()
    steps = []
    for travel in np.linspace(0, 1e-3, 2001):
        rig.state[MOTOR_ANGLE] += travel - (steps[-1][0] if steps else 0.0)
        steps.append((travel, *(one_reading(rig)[POSITION] - at_rest)))
    places = np.unique(np.array(steps)[:, 1:], axis=0)
    assert 8 <= len(places) <= 12
    sizes = np.linalg.norm(np.diff(places, axis=0), axis=1)
    assert sizes == pytest.approx(np.full(len(sizes), 8.85e-6), rel=0.02)


def test_the_encoders_are_right_to_half_a_step(bench):
    for place in [(0, 0, 0), (0.02, -0.03, 0.04), (-0.05, 0.03, 0)]:
        reading = one_reading(build_omega3(1, hand=False, place_m=place))
        assert reading[POSITION] == pytest.approx(place, abs=1.2e-5)


def test_the_mounting_is_off_by_a_degree_or_so_and_leaks_a_percent():
    rig = quiet(build_omega3(1, hand=False))
    columns = []
    for axis in range(3):
        rig.state[FILTERED_ACCELERATION : FILTERED_ACCELERATION + 3] = np.eye(3)[axis]
        columns.append(one_reading(rig)[ACCELERATION].copy())
    leak = np.abs(np.array(columns).T - np.eye(3))
    assert np.diag(leak) == pytest.approx(np.zeros(3), abs=1e-3)
    off = leak[~np.eye(3, dtype=bool)]
    assert off.min() > 0.002
    assert off.max() < 0.03


def test_the_filter_is_one_pole_at_its_frequency(bench):
    frequency_hz = 100.0
    true, measured = (
        bench.phasor(quiet(build_omega3(1, hand=True)), frequency_hz, [0, 1, 0], what=what)[1]
        for what in (TRUE_ACCELERATION, ACCELERATION)
    )
    pole = 1 / (1 + 1j * frequency_hz / Accelerometer().bandwidth_hz)
    assert measured / true == pytest.approx(pole, abs=0.03)
