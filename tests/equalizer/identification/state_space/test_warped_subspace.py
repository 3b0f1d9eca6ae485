"""Subspace identification in the frequency domain."""

import numpy as np
import pytest

from equalizer.identification.state_space.warped_subspace import (
    choose_horizon,
    compute_warp_coefficient,
    estimate_subspace,
    extract_poles_and_shapes,
)
from equalizer.identification.state_space.weighted_lines import weight_lines

BAND = (5.0, 35.0)


def test_the_map_puts_the_centre_of_the_band_at_a_quarter_turn():
    c, z = compute_warp_coefficient(13.0, 1000.0), np.exp(2j * np.pi * 13 / 1000)
    assert (z - c) / (1 - c * z) == pytest.approx(1j)


def test_poles_come_out_exactly_where_there_is_no_noise(plants, measuring):
    plant = measuring.small_plant(plants)
    lines = weight_lines([measuring.exact(plant, np.arange(5, 35, 0.1))], BAND)
    form = extract_poles_and_shapes(estimate_subspace(lines, choose_horizon(6, 3), 13.2), 6, 0.9999)
    np.testing.assert_allclose(np.sort_complex(form.poles), np.sort_complex(np.linalg.eigvals(plant.A)), atol=1e-9)


def test_singular_values_stand_clear_of_the_noise_as_often_as_there_are_states(plants, measuring):
    plant = measuring.small_plant(plants)
    lines = weight_lines([measuring.noisy(plant, np.arange(5, 35, 0.05), 0.3, seed=5)], BAND)
    values = estimate_subspace(lines, 8, 13.2).singular_values
    assert values[5] > 2
    assert values[6:] == pytest.approx(1.0, abs=0.3)


def test_pure_noise_shows_no_state(measuring):
    random = np.random.default_rng(8)
    frequency = np.arange(5, 35, 0.05)
    real, imaginary = random.standard_normal((2, len(frequency), 3, 3))
    noise = measuring.response_of(frequency, (real + 1j * imaginary) / np.sqrt(2), 1.0)
    values = estimate_subspace(weight_lines([noise], BAND), 8, 13.2).singular_values
    assert values.max() < 1.3


def test_outputs_of_very_different_noise_are_brought_to_one_measure(plants, measuring):
    plant = measuring.small_plant(plants)
    frequency = np.arange(5, 35, 0.05)
    deviation = np.array([0.1, 0.1, 10.0])[:, None] * np.ones(3)
    random = np.random.default_rng(9)
    real, imaginary = random.standard_normal((2, len(frequency), 3, 3))
    values = plant.response(frequency) + deviation * (real + 1j * imaginary) / np.sqrt(2)
    lines = weight_lines([measuring.response_of(frequency, values, deviation**2)], BAND)
    subspace = estimate_subspace(lines, 8, 13.2)
    assert subspace.singular_values[7:] == pytest.approx(1.0, abs=0.3)
    found = np.sort_complex(extract_poles_and_shapes(subspace, 6, 0.9999).poles)
    np.testing.assert_allclose(found, np.sort_complex(np.linalg.eigvals(plant.A)), atol=4e-3)
