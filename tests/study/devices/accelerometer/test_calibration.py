"""Six positions: a sensor with bias, cross-axis and noise is recovered, and one laid down wrongly is refused."""

import numpy as np
import pytest

from study.devices.accelerometer.calibration import GRAVITY_MPS2, POSITIONS, UP_DIRECTIONS, calibrate

COUNTS_PER_MPS2 = 0.3 / 3.3 * 65536 / GRAVITY_MPS2
"""ADXL335: 300 mV/g at 3 V, read with 16 bits over 3.3 V."""


def sensor(seed: int) -> tuple[np.ndarray, np.ndarray]:
    random = np.random.default_rng(seed)
    sensitivity = COUNTS_PER_MPS2 * (np.diag(random.uniform(0.9, 1.1, 3)) + random.normal(0, 0.02, (3, 3)))
    return sensitivity, random.uniform(28_000, 37_000, 3)


def readings(seed: int, noise_counts: float = 40.0, tilt_deg: float = 0.0, count: int = 2000) -> tuple:
    random = np.random.default_rng(100 + seed)
    sensitivity, bias = sensor(seed)
    positions = []
    for up in UP_DIRECTIONS:
        tilted = up + np.radians(tilt_deg) * random.normal(0, 1, 3)
        at_rest = sensitivity @ (GRAVITY_MPS2 * tilted / np.linalg.norm(tilted)) + bias
        positions.append(np.round(at_rest + noise_counts * random.normal(0, 1, (count, 3))))
    return tuple(positions)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_bias_sensitivity_and_noise_are_recovered(seed):
    sensitivity, bias = sensor(seed)
    found = calibrate(readings(seed))
    np.testing.assert_allclose(found.bias, bias, atol=3)
    np.testing.assert_allclose(found.sensitivity, sensitivity, atol=0.002 * COUNTS_PER_MPS2)
    np.testing.assert_allclose(found.noise_mps2, 40 / COUNTS_PER_MPS2, rtol=0.2)
    moving = np.random.default_rng(seed).uniform(-25, 25, (100, 3))
    np.testing.assert_allclose(found.to_acceleration(moving @ sensitivity.T + bias), moving, atol=0.1)
    np.testing.assert_allclose(found.to_acceleration(sensitivity @ moving[0] + bias), moving[0], atol=0.1)


def test_tilts_of_a_degree_leave_a_percent():
    sensitivity, _ = sensor(1)
    found = calibrate(readings(1, tilt_deg=1.0))
    np.testing.assert_allclose(found.sensitivity, sensitivity, atol=0.05 * COUNTS_PER_MPS2)
    assert 0.001 < found.residual_g < 0.05
    assert found.cross_axis < 0.1


@pytest.mark.parametrize("swapped", [(0, 1), (0, 2), (3, 5)])
def test_positions_in_the_wrong_order_are_refused(swapped):
    positions = list(readings(2))
    first, second = swapped
    positions[first], positions[second] = positions[second], positions[first]
    if swapped == (0, 1):  # upside down is another sensor's sign, and fits: the sign of its channel tells
        assert calibrate(tuple(positions)).sensitivity[0, 0] < 0
        return
    with pytest.raises(ValueError, match="is off by .* lay the sensor down again"):
        calibrate(tuple(positions))


def test_a_dead_channel_is_refused():
    positions = tuple(samples * [1, 1, 0] for samples in readings(3))
    with pytest.raises(ValueError, match="hardly responds to gravity"):
        calibrate(positions)


def test_a_position_that_is_missing_is_refused():
    with pytest.raises(ValueError, match=f"{len(POSITIONS)} positions are needed"):
        calibrate(readings(1)[:5])
