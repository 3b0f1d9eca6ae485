"""Uncertainty of an identified model by a parametric bootstrap: the model is refitted to its own response plus random
noise with the lines' standard errors, once for each draw.

Reference: Efron and Tibshirani, An Introduction to the Bootstrap (1993), chapter 6. Called by `identify`.

Sizes: p outputs, m inputs, k parameters (entries of A, B, C and D).
"""

from dataclasses import replace

import numpy as np

from equalizer.identification.state_space.refinement import FittedForm, refine_form
from equalizer.identification.state_space.relaxed_poles import SlowPole
from equalizer.identification.state_space.stable_poles import Radius
from equalizer.identification.state_space.weighted_lines import WeightedLines
from equalizer.plant.identified_model import IdentifiedModel
from equalizer.plant.model_response import compute_model_response
from equalizer.signals.signal import FloatArray

BAND_POINTS = 200
"""Number of equally spaced frequencies of the integral over the band. Chosen by hand."""
PEAK_OFFSETS = np.sinh(np.linspace(-4, 4, 41))
"""Distances of frequencies from a slow pole, in half-widths of its peak: dense at the peak, up to 27.
Chosen by hand."""
REFIT_STEPS = 3
"""Levenberg-Marquardt steps of each refit, which are enough because a draw of the noise moves the minimum little.
Chosen by hand."""


def draw_bootstrap_parameters(
    fitted: FittedForm, lines: WeightedLines, radius: Radius, noise_factor: float, draws: int, seed: int
) -> FloatArray:
    """Draw parameters by a parametric bootstrap, (draws, k), in the order of `IdentifiedModel.parameters`; each row is
    a fit to another draw of complex normal noise. lines: the fitted lines, binned or not. radius: largest magnitude of
    the poles (`stable_poles.Radius`). noise_factor: assumed standard error over 1 / weight, above 1 where residuals
    exceed the noise. draws: at least one. seed: of the random generator; the same seed gives the same draws.

    A covariance from the Jacobian is not used: where the order is higher than the data determine, the response depends
    on some directions of the parameters only beyond first order, and normally distributed draws would be unstable
    models. Refitting keeps every draw within the decay bound.
    """
    generator = np.random.default_rng(seed)
    modelled_response = fitted.compute_response(lines.z)
    part_deviation = noise_factor / lines.weight / np.sqrt(2)
    refitted_parameters = []
    for _ in range(draws):
        real, imaginary = generator.standard_normal((2, *modelled_response.shape))
        noisy_lines = replace(lines, response=modelled_response + part_deviation * (real + 1j * imaginary))
        refit = refine_form(fitted.form, noisy_lines, radius, REFIT_STEPS)
        matrices = (refit.form.state_matrix, refit.B, refit.form.C, refit.D)
        refitted_parameters.append(np.concatenate([matrix.ravel() for matrix in matrices]))
    return np.array(refitted_parameters)


def estimate_response_deviation(model: IdentifiedModel, frequency_hz: FloatArray) -> FloatArray:
    """Estimate the standard error of each entry of the response, (lines, p, m): rms deviation of the model's samples
    from the model. frequency_hz: (lines,). Raises ValueError for a model without samples."""
    if model.samples is None:
        raise ValueError("the model contains no samples of its uncertainty; identify it again with draws > 0")
    nominal_response = compute_model_response(model, frequency_hz)
    squared_deviations = [
        np.abs(compute_model_response(model.replace_parameters(parameters), frequency_hz) - nominal_response) ** 2
        for parameters in model.samples
    ]
    return np.asarray(np.sqrt(np.mean(squared_deviations, axis=0)), dtype=np.float64)


def compute_relative_deviation(
    model: IdentifiedModel, frequency_hz: FloatArray, slow_poles: tuple[SlowPole, ...]
) -> float | None:
    """Compute the rms standard error of the response over the band, relative to the response's rms; None without
    samples or with fewer than two lines. frequency_hz: (lines,), rising; the band is from the first to the last. The
    grid of the integral is finer about slow poles, because a narrow resonance may have its peak between two lines."""
    if model.samples is None or len(frequency_hz) < 2:
        return None
    low_hz, high_hz = frequency_hz[0], frequency_hz[-1]
    peak_frequencies_hz = [pole.frequency_hz + PEAK_OFFSETS / (2 * np.pi * pole.decay_s) for pole in slow_poles]
    grid_hz = np.unique(
        np.clip(np.concatenate([np.linspace(low_hz, high_hz, BAND_POINTS), *peak_frequencies_hz]), low_hz, high_hz)
    )
    spacing_hz = np.gradient(grid_hz)[:, None, None]
    response_norm = np.sqrt((spacing_hz * np.abs(compute_model_response(model, grid_hz)) ** 2).sum())
    return float(np.sqrt((spacing_hz * estimate_response_deviation(model, grid_hz) ** 2).sum()) / response_norm)
