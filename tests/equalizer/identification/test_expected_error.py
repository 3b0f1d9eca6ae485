"""The error that an identified model states is not below the one it has, over the band and between its lines."""

import numpy as np
import pytest

from equalizer.identification.state_space.identify import identify
from equalizer.identification.state_space.settings import IdentificationSettings

BAND = np.linspace(5, 35, 3001)
NOISE = 0.05
"""m/s² per N, of each entry of each line."""
QUICK = IdentificationSettings(order=12, draws=12, longer_horizons=(0,))
PLANTS = [pytest.param(seed, marks=() if seed < 4 else pytest.mark.slow) for seed in range(24)]


def resonant(plants, dampings, random):
    """Three coupled resonances behind a rigid body; motor, sensor and delay make it no model of order 12."""
    modes = [(3.5, 1.4, axis / np.sqrt(plants.MASS_KG)) for axis in np.eye(3)]
    for (low, high), damping in zip(((8.0, 13.0), (15.0, 22.0), (25.0, 33.0)), dampings, strict=True):
        shape = random.standard_normal(3)
        modes.append((random.uniform(low, high), damping, 0.8 * shape / np.linalg.norm(shape)))
    return plants._sampled(modes)


@pytest.mark.slow
@pytest.mark.parametrize("seed", PLANTS)
def test_the_true_error_is_not_above_the_stated_one(plants, measuring, seed):
    random = np.random.default_rng([18, seed])
    plant = resonant(plants, 10 ** random.uniform(-3, -1, 3), random)
    lines = np.arange(4.6, 38.4, 1 / random.choice([10, 15, 30]))
    found = identify(measuring.noisy(plant, lines, NOISE, seed), QUICK)
    inside = lines[(lines >= 5) & (lines <= 35)]
    true = max(measuring.errors_of(found.model, plant, grid)[0] for grid in (BAND, inside))
    assert true <= found.expected_error
    assert found.expected_error < 12 * true  # a statement, not a blank cheque


def test_a_tenth_of_a_per_cent_of_damping_near_8_hz(plants, measuring):
    random = np.random.default_rng(18)
    modes = [(3.5, 1.4, axis / np.sqrt(plants.MASS_KG)) for axis in np.eye(3)]
    for frequency, damping in ((8.0, 0.001), (18.0, 0.05), (29.0, 0.04)):
        shape = random.standard_normal(3)
        modes.append((frequency, damping, 0.8 * shape / np.linalg.norm(shape)))
    plant = plants._sampled(modes)
    found = identify(measuring.noisy(plant, np.arange(4.6, 38.4, 1 / 30), NOISE, 18), QUICK)
    assert found.relaxed[0].frequency_hz == pytest.approx(8.0, rel=1e-3)
    assert measuring.errors_of(found.model, plant, BAND)[0] <= found.expected_error
