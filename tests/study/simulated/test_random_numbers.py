import numpy as np
import pytest
from numba import njit

from study.devices.simulated.sensors import draw_three_normals, draw_uniform


@njit
def draw(noise, rows):
    for k in range(len(rows)):
        draw_three_normals(noise, rows[k])


@pytest.fixture(scope="module")
def normals():
    rows = np.empty((100_000, 3))
    draw(np.array([7], dtype=np.uint64), rows)
    return rows


def test_they_are_standard_normal_and_independent(normals):
    assert normals.mean(axis=0) == pytest.approx(np.zeros(3), abs=0.015)
    assert np.cov(normals.T) == pytest.approx(np.eye(3), abs=0.02)
    assert (normals**4).mean(axis=0) == pytest.approx(np.full(3, 3.0), abs=0.15)
    assert (normals[1:] * normals[:-1]).mean(axis=0) == pytest.approx(np.zeros(3), abs=0.015)


def test_the_generator_is_the_published_one():
    """First output of SplitMix64 from state 0 (reference implementation of its authors)."""
    noise = np.zeros(1, dtype=np.uint64)
    assert draw_uniform(noise) == ((0xE220A8397B1DCDAF >> 11) + 1) / 2**53
