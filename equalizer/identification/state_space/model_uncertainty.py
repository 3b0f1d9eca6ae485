"""How well a model is known: draws of its parameters, each the fit that equally likely noise would have led to.

A covariance from the Jacobian would not do: an order above what the band shows leaves directions in which the
response hardly changes at first and then at once, so draws from it are unstable models. Refitting keeps every draw
within the decay bound, and is right to second order for the cost of a few steps each (parametric bootstrap, Efron
and Tibshirani 1993).
"""

from dataclasses import replace

import numpy as np

from equalizer.identification.state_space.refinement import FittedForm, refine
from equalizer.identification.state_space.stable_poles import Radius
from equalizer.identification.state_space.weighted_lines import WeightedLines
from equalizer.plant.identified_model import IdentifiedModel
from equalizer.plant.model_response import model_response
from equalizer.signals.signal import FloatArray

STEPS = 3


def parameter_draws(
    fitted: FittedForm, lines: WeightedLines, radius: Radius, noise_factor: float, draws: int, seed: int
) -> FloatArray:
    """(draws, k), in the order of `IdentifiedModel.parameters`.

    lines: those that the fit was made to, binned or not; noise_factor: what the noise is taken to be over what the
    weights say, above 1 where the fit leaves more than noise.
    """
    random = np.random.default_rng(seed)
    modelled = fitted.response(lines.z)
    deviation = noise_factor / lines.weight / np.sqrt(2)
    rows = []
    for _ in range(draws):
        real, imaginary = random.standard_normal((2, *modelled.shape))
        noisy = replace(lines, response=modelled + deviation * (real + 1j * imaginary))
        drawn = refine(fitted.form, noisy, radius, STEPS)
        parts = (drawn.form.state_matrix, drawn.B, drawn.form.C, drawn.D)
        rows.append(np.concatenate([part.ravel() for part in parts]))
    return np.array(rows)


def response_deviation(model: IdentifiedModel, frequency_hz: FloatArray) -> FloatArray:
    """Standard error |δG| of each entry, (lines, p, m), from the model's samples. Raises ValueError without them."""
    if model.samples is None:
        raise ValueError("the model holds no samples of its uncertainty; identify it again with draws > 0")
    middle = model_response(model, frequency_hz)
    squares = [np.abs(model_response(model.with_parameters(row), frequency_hz) - middle) ** 2 for row in model.samples]
    return np.asarray(np.sqrt(np.mean(squares, axis=0)), dtype=np.float64)
