"""Subspace identification of time records."""

from dataclasses import replace

import numpy as np
import pytest

from equalizer.identification.state_space.canonical_variate import (
    choose_decimation_factor,
    collect_driven_records,
    estimate_observability,
    estimate_poles_and_shapes,
)
from equalizer.signals.recording import Segment


@pytest.fixture(scope="module")
def plant(plants, measuring):
    return measuring.small_plant(plants)


def record(plant, n, seed, noise):
    random = np.random.default_rng(seed)
    command = random.standard_normal((n, 3))
    return np.hstack([command, plant.play(command) + noise * random.standard_normal((n, 3))])


def pole_error(form, plant):
    true = np.linalg.eigvals(plant.A)
    return max(np.abs(form.poles - pole).min() for pole in true)


def test_poles_of_a_small_plant_are_recovered_from_one_record(plant):
    observed = estimate_observability([record(plant, 4000, 1, 1e-6)], 3, 6)
    assert pole_error(estimate_poles_and_shapes(observed, 3, 6, 1, 0.9999), plant) < 1e-5


def test_records_are_not_joined_where_they_do_not_meet(plant):
    """Many short records with noise do what one long one does."""
    short = [record(plant, 800, seed, 1.0) for seed in range(10)]
    long = [record(plant, 8000, 50, 1.0)]
    errors = [
        pole_error(estimate_poles_and_shapes(estimate_observability(records, 3, 8), 3, 6, 1, 0.9999), plant)
        for records in (short, long)
    ]
    assert errors[0] < 2.5 * errors[1]
    assert errors[0] < 0.002


def test_a_decimated_pole_becomes_its_root():
    pole = np.exp((-9 + 60j) / 1000)
    observed = np.vstack([[[1.0, 0.0]] @ np.linalg.matrix_power(turned(pole**8), k) for k in range(6)])
    form = estimate_poles_and_shapes(observed, 1, 2, 8, 0.9999)
    np.testing.assert_allclose(np.sort_complex(form.poles), np.sort_complex([pole, pole.conjugate()]), atol=1e-12)


def turned(pole):
    return np.array([[pole.real, pole.imag], [-pole.imag, pole.real]])


def test_the_rate_is_brought_down_to_the_band():
    assert choose_decimation_factor(1000.0, 35.0) == 8
    assert choose_decimation_factor(1000.0, 450.0) == 1


def test_test_segments_rest_and_holes_are_left_out(plants, synthetic):
    recording = synthetic.sweeps(plants, 4.5, 37.0, 2.0)
    assert [len(part) for part in collect_driven_records([recording], 8)] == [500, 500, 500]
    first, second, third = recording.segments
    holes = recording.response.samples.copy()
    holes[third.start + 5] = np.nan
    changed = replace(
        recording,
        response=replace(recording.response, samples=holes),
        segments=(replace(first, role="test"), second, third, Segment(0, 1000, "rest")),
    )
    assert len(collect_driven_records([changed], 8)) == 1


def test_too_short_records_give_no_start(plant):
    assert estimate_observability([record(plant, 100, 1, 0.1)], 3, 16) is None
    assert estimate_observability([], 3, 16) is None
