"""Uncertainty of an identified model by a parametric bootstrap: the model is refitted to its own response plus random
noise with the lines' standard errors, once for each draw.

Reference: Efron and Tibshirani, An Introduction to the Bootstrap (1993), chapter 6.
"""

from dataclasses import replace

import numpy as np

from equalizer.identification.state_space.refinement import FittedForm, refine
from equalizer.identification.state_space.relaxed_poles import SlowPole
from equalizer.identification.state_space.stable_poles import Radius
from equalizer.identification.state_space.weighted_lines import WeightedLines
from equalizer.plant.identified_model import IdentifiedModel
from equalizer.plant.model_response import model_response
from equalizer.signals.signal import FloatArray

BAND_POINTS = 200
"""Number of equally spaced frequencies of the integral over the band."""
WIDTHS = np.sinh(np.linspace(-4, 4, 41))
"""Distances of frequencies from a slow pole, in half-widths of its peak: dense at the peak, up to 27."""
STEPS = 3
"""Levenberg-Marquardt steps of each refit: a draw of the noise moves the minimum little."""


def parameter_draws(
    fitted: FittedForm, lines: WeightedLines, radius: Radius, noise_factor: float, draws: int, seed: int
) -> FloatArray:
    """Parametric bootstrap (draws, k), in the order of `IdentifiedModel.parameters`; each row is a fit to another draw
    of the noise. lines: the fitted lines, binned or not. noise_factor: assumed standard error over 1 / weight, above 1
    where residuals exceed the noise.

    A covariance from the Jacobian is not used: where the order is higher than the data determine, the response depends
    on some directions of the parameters only beyond first order, and normally distributed draws would be unstable
    models. Refitting keeps every draw within the decay bound.
    """
    random = np.random.default_rng(seed)
    modelled = fitted.compute_response(lines.z)
    deviation = noise_factor / lines.weight / np.sqrt(2)
    rows = []
    for _ in range(draws):
        real, imaginary = random.standard_normal((2, *modelled.shape))
        noisy = replace(lines, response=modelled + deviation * (real + 1j * imaginary))
        refit = refine(fitted.form, noisy, radius, STEPS)
        parts = (refit.form.state_matrix, refit.B, refit.form.C, refit.D)
        rows.append(np.concatenate([part.ravel() for part in parts]))
    return np.array(rows)


def response_deviation(model: IdentifiedModel, frequency_hz: FloatArray) -> FloatArray:
    """Standard error of each entry of the response, (lines, p, m): rms deviation of the model's samples from the model.
    Raises ValueError for a model without samples."""
    if model.samples is None:
        raise ValueError("the model contains no samples of its uncertainty; identify it again with draws > 0")
    middle = model_response(model, frequency_hz)
    squares = [np.abs(model_response(model.with_parameters(row), frequency_hz) - middle) ** 2 for row in model.samples]
    return np.asarray(np.sqrt(np.mean(squares, axis=0)), dtype=np.float64)


def scatter_of_draws(model: IdentifiedModel, frequency_hz: FloatArray, slow: tuple[SlowPole, ...]) -> float | None:
    """Rms standard error of the response over the band, relative to the response's rms; None without samples. The grid
    is finer about slow poles, because a narrow resonance may have its peak between two lines."""
    if model.samples is None or len(frequency_hz) < 2:
        return None
    low, high = frequency_hz[0], frequency_hz[-1]
    peaks = [pole.frequency_hz + WIDTHS / (2 * np.pi * pole.decay_s) for pole in slow]
    grid = np.unique(np.clip(np.concatenate([np.linspace(low, high, BAND_POINTS), *peaks]), low, high))
    spacing_hz = np.gradient(grid)[:, None, None]
    size = np.sqrt((spacing_hz * np.abs(model_response(model, grid)) ** 2).sum())
    return float(np.sqrt((spacing_hz * response_deviation(model, grid) ** 2).sum()) / size)
