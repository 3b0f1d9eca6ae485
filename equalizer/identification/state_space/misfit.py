"""Misfit of an identified model on the lines of a measured frequency response, reported with the model.

It is the power of the residuals in excess of the noise power of the lines, with an upper bound of the misfit that the
noise may hide, and the correlation of the residuals from line to line. Called by `identify` and `identify_recordings`.
"""

from dataclasses import dataclass

import numpy as np

from equalizer.identification.frequency_response.frequency_response import FrequencyResponse
from equalizer.identification.state_space.weighted_lines import WeightedLines, weight_lines
from equalizer.plant.identified_model import IdentifiedModel
from equalizer.plant.model_response import compute_model_response
from equalizer.signals.signal import BoolArray, ComplexArray, FloatArray

NOISE_POWER_MARGIN = 1.1
"""Multiple of the noise power that counts as noise: only residual power above it is a misfit, because the noise itself
is estimated from few periods. Chosen."""


@dataclass(frozen=True, slots=True)
class Misfit:
    """Lack of fit of a model on measured lines."""

    error: float
    """Root mean square of model - estimate in excess of the noise, relative to the response's; 0 where the residual is
    noise."""
    upper_bound: float | None
    """Upper 95 % bound of the misfit that the noise may hide, also relative to the response; accounts for the scatter
    of the noise and of its estimate, and for the degrees of freedom that the fit used. Not below `error`. None where
    the lines contain transients or leakage, of which no bound is known (set by `identify_recordings`)."""
    cost: float
    """Squared difference over noise variance, mean over all entries of the lines: about 1 where the residual is
    noise."""
    smooth: float | None
    """Correlation between neighbouring lines of the residual in excess of the noise: near 1 for a linear response that
    the model lacks, near 0 for lines that scatter; None for a single line, where the residual is noise, or where
    the noise was estimated from the scatter of the lines (set by `identify_recordings`)."""


NORMAL_QUANTILE_95 = 1.645
"""Quantile of the normal distribution at 95 %."""


def compute_misfit(lines: WeightedLines, modelled: ComplexArray, in_band: BoolArray, parameter_count: int) -> Misfit:
    """Compute the misfit of modelled responses (lines, p, m). in_band: (lines,), mask of the lines that count.
    parameter_count: number of real parameters that were fitted."""
    residual = (modelled - lines.response)[in_band]
    weight = lines.weight[in_band]
    response_power = float((np.abs(lines.response[in_band]) ** 2).sum())
    excess_power = float((np.abs(residual) ** 2).sum() - NOISE_POWER_MARGIN * (1 / weight**2).sum())
    hidden_power = float((np.abs(residual) ** 2).sum() - _compute_lower_noise_bound(1 / weight**2, parameter_count))
    weighted_residual = weight * residual
    weighted_power = float((np.abs(weighted_residual) ** 2).sum())
    smoothness = None
    if weighted_power > NOISE_POWER_MARGIN * weighted_residual.size and len(weighted_residual) > 1:
        neighbour_product = (
            float((weighted_residual[1:] * weighted_residual[:-1].conj()).real.sum())
            * len(weighted_residual)
            / (len(weighted_residual) - 1)
        )
        smoothness = neighbour_product / (weighted_power - weighted_residual.size)
    error, error_bound = (
        float(np.sqrt(max(misfit_power, 0.0) / max(response_power, 1e-300)))
        for misfit_power in (excess_power, max(excess_power, hidden_power))
    )
    return Misfit(error, error_bound, weighted_power / max(weighted_residual.size, 1), smoothness)


def _compute_lower_noise_bound(variance: FloatArray, parameter_count: int) -> float:
    """Compute the one-sided lower 95 % bound of the noise power in the residuals, by a normal approximation: the
    relative variance 2 / entries counts the scatter of the noise and that of its estimate. variance: noise variance of
    each complex entry, i.e. of two real numbers, of which the fit of parameter_count parameters absorbs as many."""
    noise_power = float(variance.sum())
    effective_entries = noise_power**2 / max(float((variance**2).sum()), 1e-300)  # effective number of entries
    return noise_power * (
        1
        - parameter_count / (2 * max(variance.size, 1))
        - NORMAL_QUANTILE_95 * float(np.sqrt(2 / max(effective_entries, 1.0)))
    )


def compute_estimate_misfit(model: IdentifiedModel, estimate: FrequencyResponse) -> Misfit:
    """Compute the misfit of a model on an estimate's reliable lines within the model's band."""
    lines = weight_lines((estimate,), model.band_hz)
    modelled_response, is_counted = compute_model_response(model, lines.frequency_hz), np.ones(len(lines), bool)
    return compute_misfit(lines, modelled_response, is_counted, count_unknowns(model.order, *model.D.shape))


def count_unknowns(order: int, output_count: int, input_count: int) -> int:
    """Count the identifiable real parameters of a model with p outputs and m inputs: its n (n + m + p) + p m entries
    less the n² of a change of state coordinates, n = order."""
    return order * (output_count + input_count) + output_count * input_count
