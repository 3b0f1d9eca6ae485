"""Convergence test of iterative learning control at a place, from the models' uncertainty and their differences.

The device at the place is unknown: it may be any draw from any model's uncertainty or, between places, any of the
models used. Learning corrects forces by the weighted sum of the models' inverses. With the response G from total force
to acceleration a, and a virtual spring whose force is K a, forces u added to the spring's force give a = G (u + K a),
hence the closed loop

    a = (I - G K)^-1 G u.

The condition of convergence is that of `equalizer.tracking.learning.convergence`.
"""

import numpy as np

from equalizer.plant.model_response import compute_model_response
from equalizer.signals.signal import ComplexArray, FloatArray
from equalizer.tracking.feedforward.virtual_spring import VirtualSpring
from equalizer.tracking.learning.convergence import Convergence, predict_convergence
from equalizer.tracking.workspace.feedforward_at_place import select_used_models
from equalizer.tracking.workspace.models_at_place import ModelsAtPlace

LINE_COUNT = 120
"""Number of logarithmically spaced lines over the band at which convergence is tested. Chosen."""


def predict_convergence_at(
    models_at_place: ModelsAtPlace, weight: float, spring: VirtualSpring, beta: float = 1.0
) -> Convergence | None:
    """Predict the worst-case convergence over all possible devices at the place. weight: R = weight I of the inverses,
    (m/s² per N)²; spring: acts on the device, but is not in the models; beta: gain of learning. None for a single model
    without uncertainty: its inverse would be tested on the model itself."""
    used_models = [model for _, model in select_used_models(models_at_place)]
    band_hz = used_models[0].band_hz
    lines_hz = np.asarray(np.geomspace(*band_hz, LINE_COUNT), dtype=np.float64)
    devices = [compute_model_response(model, lines_hz) for model in used_models] if len(used_models) > 1 else []
    for model in used_models:
        if model.samples is not None:
            devices += [
                compute_model_response(model.replace_parameters(parameters), lines_hz) for parameters in model.samples
            ]
    if not devices:
        return None
    closed_loops = np.array([_close_spring_loop(device, lines_hz, spring) for device in devices])
    return predict_convergence(
        models_at_place.compute_inverse(lines_hz, weight, spring), closed_loops, lines_hz, band_hz, beta
    )


def _close_spring_loop(device: ComplexArray, frequency_hz: FloatArray, spring: VirtualSpring) -> ComplexArray:
    """(lines, p, p), m/s² per N: closed loop (I - G K)^-1 G. device: G, (lines, p, p); frequency_hz: (lines,)."""
    spring_force = spring.compute_force_per_acceleration(frequency_hz)[:, None, None]
    return_difference = np.eye(device.shape[1]) - device * spring_force
    return np.asarray(np.linalg.solve(return_difference, device), dtype=np.complex128)
