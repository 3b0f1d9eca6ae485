"""Frequency responses with known noise, and what a model errs by against the truth."""

import numpy as np

from equalizer.identification.frequency_response.frequency_response import FrequencyResponse
from equalizer.plant.model_response import compute_model_response

AXES = ("x", "y", "z")


def response_of(frequency_hz, values, variance, rate_hz=1000.0, names=AXES) -> FrequencyResponse:
    lines, p, m = values.shape
    coherence, reliable = np.full((lines, p), np.nan), np.ones(lines, bool)
    spread = np.broadcast_to(variance, values.shape).astype(float)
    return FrequencyResponse(frequency_hz, values, spread, coherence, reliable, rate_hz, names[:m], names[:p])


def swept(plants, plant, seed, low_hz=4.5, high_hz=37.0, seconds=30.0) -> FrequencyResponse:
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
    variance = plants.SENSOR_RMS[:, None] ** 2 * n / np.abs(entered[kept])[:, None, None] ** 2
    return response_of(frequency[kept], np.stack(columns, axis=2), variance)


def exact(plant, frequency_hz, relative_noise=1e-9) -> FrequencyResponse:
    """Without noise; the variance says how much it would be."""
    values = plant.response(frequency_hz)
    return response_of(frequency_hz, values, (relative_noise * np.abs(values).max()) ** 2)


def noisy(plant, frequency_hz, deviation, seed) -> FrequencyResponse:
    values = plant.response(frequency_hz)
    real, imaginary = np.random.default_rng(seed).standard_normal((2, *values.shape))
    return response_of(frequency_hz, values + deviation * (real + 1j * imaginary) / np.sqrt(2), deviation**2)


def small_plant(plants):
    """Order 6: three resonances, fully coupled, sampled at 1 kHz."""
    poles = np.exp(np.array([-9 + 60j, -12 + 110j, -25 + 180j]) / plants.RATE_HZ)
    blocks = np.zeros((6, 6))
    for k, pole in enumerate(poles):
        blocks[2 * k : 2 * k + 2, 2 * k : 2 * k + 2] = [[pole.real, pole.imag], [-pole.imag, pole.real]]
    random = np.random.default_rng(3)
    return plants.Plant(blocks, random.standard_normal((6, 3)), random.standard_normal((3, 6)))


def errors_of(model, plant, frequency_hz) -> tuple[float, float]:
    """Root mean square over that of the truth, and the worst line's own."""
    truth = plant.response(frequency_hz)
    error = np.linalg.norm(compute_model_response(model, frequency_hz) - truth, axis=(1, 2))
    size = np.linalg.norm(truth, axis=(1, 2))
    return float(np.sqrt((error**2).sum() / (size**2).sum())), float((error / size).max())


def held_out_error(plants, model, plant) -> float:
    """Of 10 s of a periodic random-phase multisine in 5 to 35 Hz on all axes: model against true acceleration."""
    period = plants.multisine(5.0, 35.0)
    commands = np.tile(period, (2, 1))
    truth = plant.play(commands)[len(period) :]
    states = plants.Plant(model.A, model.B, model.C)
    predicted = (states.play(commands) + commands @ model.D.T)[len(period) :]
    return float(np.linalg.norm(predicted - truth) / np.linalg.norm(truth))
