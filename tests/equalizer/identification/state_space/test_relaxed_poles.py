"""Resonances that ring longer than the ordinary bound: relaxed where the data need it, and nowhere else."""

from dataclasses import replace

import numpy as np
import pytest

from equalizer.identification.state_space.identify import identify
from equalizer.identification.state_space.settings import ORDINARY_DECAY_S, IdentificationSettings

LINES = np.arange(4.6, 38.4, 1 / 15)
GRID = np.linspace(5, 35, 3001)
QUICK = IdentificationSettings(order=12, draws=3, longer_horizons=(0,))
NOISE = 0.05
"""m/s² per N, of each entry of each line."""


def device_of(plants, dampings, seed):
    """Three coupled resonances with shapes of their own behind a rigid body, of damping ratios that are given."""
    random = np.random.default_rng(seed)
    modes = [(3.5, 1.4, axis / np.sqrt(plants.MASS_KG)) for axis in np.eye(3)]
    for (low, high), damping in zip(((8.0, 13.0), (15.0, 22.0), (25.0, 33.0)), dampings, strict=True):
        shape = random.standard_normal(3)
        modes.append((random.uniform(low, high), damping, 0.8 * shape / np.linalg.norm(shape)))
    return plants._sampled(modes), [mode[:2] for mode in modes[3:]]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("dampings", "seed"),
    [
        ((0.01, 0.06, 0.05), 1),
        ((0.02, 0.003, 0.05), 2),
        ((0.06, 0.05, 0.001), 3),
        ((0.001, 0.002, 0.003), 4),
        ((0.005, 0.01, 0.002), 5),
    ],
)
def test_a_lightly_damped_resonance_is_found_to_the_noise(plants, measuring, dampings, seed):
    plant, modes = device_of(plants, dampings, seed)
    found = identify(measuring.noisy(plant, LINES, NOISE, seed), QUICK)
    light = sorted(f for f, damping in modes if 1 / (2 * np.pi * f * damping) > ORDINARY_DECAY_S)
    assert sorted(pole.frequency_hz for pole in found.relaxed) == pytest.approx(light, rel=1e-3)
    assert found.cost == pytest.approx(1.0, abs=0.05)
    rms, _ = measuring.errors_of(found.model, plant, GRID)
    noise = NOISE * 3 / np.sqrt(np.mean(np.sum(np.abs(plant.response(LINES)) ** 2, axis=(1, 2))))
    unknowns = 12 * 6 + 9
    assert rms < 3 * noise * np.sqrt(unknowns / (9 * len(LINES)))  # three times what so many unknowns leave of it
    assert any("its pole was relaxed" in remark for remark in found.remarks)
    assert found.model.spectral_radius < 1


@pytest.mark.slow
def test_a_well_damped_device_is_fitted_as_under_the_bound_to_the_last_digit(plants, measuring):
    plant, _ = device_of(plants, (0.06, 0.05, 0.05), 6)
    for order in (12, 16):  # with states to spare, some poles sit on the bound, and cost nothing there
        response = measuring.noisy(plant, LINES, NOISE, 6)
        ours = identify(response, replace(QUICK, order=order, draws=0))
        asked = identify(response, replace(QUICK, order=order, draws=0, longest_decay_s=ORDINARY_DECAY_S))
        np.testing.assert_array_equal(ours.model.parameters, asked.model.parameters)
        assert ours.relaxed == () and not ours.is_bound_binding
        assert ours.remarks == ()


def test_a_bound_that_was_asked_for_is_kept_and_what_it_costs_is_reported(plants, measuring):
    plant, _ = device_of(plants, (0.01, 0.06, 0.05), 1)
    found = identify(measuring.noisy(plant, LINES, NOISE, 1), replace(QUICK, longest_decay_s=0.5))
    assert found.model.spectral_radius <= np.exp(-1 / 500) * (1 + 1e-12)
    assert found.is_bound_binding
    assert found.remarks[0].startswith("a pole is at the bound of the decay, 0.5 s")
    assert "friction" not in " ".join(found.remarks) and "order" not in " ".join(found.remarks)
    rms, _ = measuring.errors_of(found.model, plant, GRID)
    assert rms > 0.02
    assert found.expected_error == pytest.approx(rms, rel=0.3)


def test_noise_relaxes_nothing(plants, measuring):
    plant, _ = device_of(plants, (0.06, 0.05, 0.05), 7)
    assert identify(measuring.noisy(plant, LINES, NOISE, 100), replace(QUICK, draws=0)).relaxed == ()
