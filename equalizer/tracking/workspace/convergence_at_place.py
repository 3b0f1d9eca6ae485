"""Convergence test of iterative learning at a place, from the models' uncertainty and their differences."""

import numpy as np

from equalizer.plant.model_response import model_response
from equalizer.signals.signal import ComplexArray, FloatArray
from equalizer.tracking.feedforward.virtual_spring import VirtualSpring
from equalizer.tracking.learning.convergence import Convergence, convergence
from equalizer.tracking.workspace.feedforward_at_place import used_models
from equalizer.tracking.workspace.models_at_place import ModelsAtPlace

LINES = 120
"""Lines on which convergence is tested."""


def convergence_at(at: ModelsAtPlace, weight: float, spring: VirtualSpring, beta: float = 1.0) -> Convergence | None:
    """Convergence for every draw of every model's uncertainty and, between places, for each model that is used.
    spring: what acts on the device and is not in the models. None where nothing says what the device may be."""
    used = [model for _, model in used_models(at)]
    band_hz = used[0].band_hz
    lines_hz = np.asarray(np.geomspace(*band_hz, LINES), dtype=np.float64)
    devices = [model_response(model, lines_hz) for model in used] if len(used) > 1 else []
    for model in used:
        if model.samples is not None:
            devices += [model_response(model.with_parameters(row), lines_hz) for row in model.samples]
    if not devices:
        return None
    held = np.array([_close_spring_loop(device, lines_hz, spring) for device in devices])
    model_there = np.asarray(np.linalg.inv(at.inverse(lines_hz, weight, spring)), dtype=np.complex128)
    return convergence(model_there, held, lines_hz, band_hz, beta)


def _close_spring_loop(device: ComplexArray, frequency_hz: FloatArray, spring: VirtualSpring) -> ComplexArray:
    """Response to forces that are added to the spring's, instead of to the total force."""
    share = spring.force_per_acceleration(frequency_hz)[:, None, None]
    around = np.eye(device.shape[1]) - device * share
    return np.asarray(np.linalg.solve(around, device), dtype=np.complex128)
