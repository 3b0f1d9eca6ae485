"""From a measured frequency response to a model: recovery, negative controls, and that it is always stable."""

import numpy as np
import pytest

from equalizer.identification.frequency_response import FrequencyResponse
from equalizer.identification.identify import identify
from equalizer.identification.settings import IdentificationSettings
from equalizer.plant.model_response import model_response

AXES = ("x", "y", "z")


def measured_response(plants, plant, seed, low_hz=4.5, high_hz=37.0, seconds=30.0) -> FrequencyResponse:
    """One sweep per axis, second period kept, divided line by line; the noise is that of the sensor."""
    wave = plants.sweep(low_hz, high_hz, seconds)
    n, entered = len(wave), np.fft.rfft(wave)
    frequency = np.fft.rfftfreq(n, 1 / plants.RATE_HZ)
    kept = (frequency >= low_hz) & (frequency <= high_hz)
    columns = []
    for axis in range(3):
        commands = np.zeros((2 * n, 3))
        commands[:, axis] = np.tile(wave, 2)
        came_out = np.fft.rfft(plant.measured(commands, 1000 * seed + axis)[n:], axis=0)
        columns.append(came_out[kept] / entered[kept, None])
    variance = plants.SENSOR_RMS[:, None] ** 2 * np.ones(3) * n / np.abs(entered[kept])[:, None, None] ** 2
    lines = int(kept.sum())
    unknown, reliable = np.full((lines, 3), np.nan), np.ones(lines, bool)
    return FrequencyResponse(
        frequency[kept], np.stack(columns, axis=2), variance, unknown, reliable, plants.RATE_HZ, AXES, AXES
    )


def errors_of(model, plant, frequency_hz) -> tuple[float, float]:
    """Root mean square over that of the truth, and the worst line's own."""
    truth = plant.response(frequency_hz)
    error = np.linalg.norm(model_response(model, frequency_hz) - truth, axis=(1, 2))
    size = np.linalg.norm(truth, axis=(1, 2))
    return float(np.sqrt((error**2).sum() / (size**2).sum())), float((error / size).max())


@pytest.fixture(scope="module")
def centre(plants):
    return plants.omega_like()


@pytest.fixture(scope="module")
def response(plants, centre):
    return measured_response(plants, centre, seed=1)


def test_the_device_is_found_from_noisy_sweeps_within_a_fifth_of_a_percent(centre, response):
    found = identify(response)
    rms, worst = errors_of(found.model, centre, np.linspace(5, 35, 901))
    assert rms < 0.002
    assert worst < 0.01
    assert found.model.spectral_radius < 0.9981
    assert found.cost == pytest.approx(1.0, abs=0.05)
    assert found.remarks == ()
