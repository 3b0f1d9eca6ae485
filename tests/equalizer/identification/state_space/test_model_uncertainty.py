"""What a model says about its own error."""

from dataclasses import replace

import numpy as np
import pytest

from equalizer.identification.state_space.bootstrap import estimate_response_deviation
from equalizer.identification.state_space.identify import identify
from equalizer.identification.state_space.settings import IdentificationSettings
from equalizer.plant.model_response import compute_model_response

SETTINGS = IdentificationSettings(order=6, longer_horizons=(0,), draws=30)


@pytest.fixture(scope="module")
def plant(plants, measuring):
    return measuring.small_plant(plants)


def found_at(measuring, plant, noise, deviation=0.3, **changes):
    response = measuring.noisy(plant, np.arange(4.6, 38, 0.2), deviation, noise)
    return identify(response, replace(SETTINGS, **changes)).model


@pytest.mark.slow
def test_the_interval_holds_the_truth_as_often_as_it_says(measuring, plant):
    """|error| of a complex entry exceeds 1.52 standard errors in a tenth of all cases."""
    frequency = np.arange(6, 35, 3.0)
    inside = []
    for seed in range(12):
        model = found_at(measuring, plant, seed)
        deviation = estimate_response_deviation(model, frequency)
        inside.append(np.abs(compute_model_response(model, frequency) - plant.response(frequency)) < 1.52 * deviation)
    assert 0.84 < np.mean(inside) < 0.95


def test_twice_the_noise_is_twice_the_uncertainty(measuring, plant):
    frequency = np.arange(6, 35, 3.0)
    one, two = (
        estimate_response_deviation(found_at(measuring, plant, 1, deviation), frequency) for deviation in (0.1, 0.2)
    )
    assert np.median(two / one) == pytest.approx(2.0, rel=0.1)


@pytest.mark.slow
def test_every_draw_is_stable(measuring, plant):
    model = found_at(measuring, plant, 3, order=12)
    for row in model.samples:
        assert model.replace_parameters(row).spectral_radius <= np.exp(-1 / 500) * (1 + 1e-7)


def test_another_seed_draws_otherwise_and_no_draws_leave_no_samples(measuring, plant):
    one, other = found_at(measuring, plant, 3, seed=1), found_at(measuring, plant, 3, seed=2)
    np.testing.assert_array_equal(one.parameters, other.parameters)
    assert np.abs(one.samples - other.samples).max() > 0
    without = found_at(measuring, plant, 3, draws=0)
    with pytest.raises(ValueError, match="identify it again with draws > 0"):
        estimate_response_deviation(without, np.array([10.0]))
