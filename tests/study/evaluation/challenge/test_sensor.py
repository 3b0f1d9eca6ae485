"""Sensor, clock and line."""

import numpy as np
import pytest

from study.evaluation.challenge.sensor import NOISE_MPS2, Sensor, read_sensor

REST = np.zeros((20_000, 3))


def test_at_rest_only_noise_is_read():
    response, position = read_sensor(Sensor(), REST, REST, 1000.0, np.random.default_rng(1))
    np.testing.assert_allclose(response.std(axis=0), NOISE_MPS2, rtol=0.03)
    assert position.std() == pytest.approx(np.hypot(4e-6, 1e-5 / np.sqrt(12)), rel=0.1)
    np.testing.assert_allclose(position * 1e5, np.round(position * 1e5), atol=1e-9)


def test_the_range_is_three_g():
    response, _ = read_sensor(Sensor(), REST + 100.0, REST, 1000.0, np.random.default_rng(1))
    assert response.max() == pytest.approx(29.43)


def test_a_clock_ahead_reads_what_comes_later():
    t = np.arange(len(REST))[:, None] / 1000.0
    _, position = read_sensor(Sensor(clock_error_ppm=1000.0), REST, 0.1 * t + REST, 1000.0, np.random.default_rng(1))
    assert position[10_000, 0] == pytest.approx(0.1 * t[10_010, 0], abs=4e-5)


def test_lost_samples_repeat_the_one_before():
    response, _ = read_sensor(Sensor(lost_fraction=0.1), REST, REST, 1000.0, np.random.default_rng(1))
    assert np.mean((np.diff(response, axis=0) == 0.0).all(axis=1)) == pytest.approx(0.1, abs=0.01)
