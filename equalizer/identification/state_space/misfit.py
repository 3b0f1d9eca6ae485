"""Misfit of an identified model on the lines of a measured frequency response, reported with the model.

It is the power of the residuals in excess of the noise power of the lines, with an upper bound of the misfit that the
noise may hide, and the correlation of the residuals from line to line.
"""

from dataclasses import dataclass

import numpy as np

from equalizer.identification.frequency_response.frequency_response import BoolArray, FrequencyResponse
from equalizer.identification.state_space.weighted_lines import WeightedLines, weight_lines
from equalizer.plant.identified_model import IdentifiedModel
from equalizer.plant.model_response import model_response
from equalizer.signals.signal import ComplexArray, FloatArray

NOISE_TRUSTED = 1.1
"""Residual power over noise power below which no misfit is reported, because the noise itself is estimated from few
periods. Heuristic."""


@dataclass(frozen=True, slots=True)
class Misfit:
    """Lack of fit of a model on measured lines."""

    error: float
    """Root mean square of model - estimate in excess of the noise, relative to the response's; 0 where the residual is
    noise."""
    upper_bound: float
    """Upper 95 % bound of the misfit that the noise may hide, also relative to the response; accounts for the scatter
    of the noise and of its estimate, and for the degrees of freedom that the fit used. Not below `error`."""
    cost: float
    """Squared difference over noise variance, mean over all entries of the lines: about 1 where the residual is
    noise."""
    smooth: float | None
    """Correlation between neighbouring lines of the residual in excess of the noise: near 1 for a linear response that
    the model lacks, near 0 for lines that scatter; None where the residual is noise, or where the noise was estimated
    from the scatter of the lines."""


ONE_SIDED_95 = 1.645
"""Quantile of the normal distribution at 95 %."""


def misfit_of(lines: WeightedLines, modelled: ComplexArray, in_band: BoolArray, unknowns: int) -> Misfit:
    """Misfit of modelled responses (lines, p, m). in_band: (lines,), mask of the lines that count. unknowns: number of
    real parameters that were fitted."""
    residual = (modelled - lines.response)[in_band]
    weight = lines.weight[in_band]
    response_power = float((np.abs(lines.response[in_band]) ** 2).sum())
    excess_power = float((np.abs(residual) ** 2).sum() - NOISE_TRUSTED * (1 / weight**2).sum())
    hidden_power = float((np.abs(residual) ** 2).sum() - _lower_noise_bound(1 / weight**2, unknowns))
    weighted = weight * residual
    power = float((np.abs(weighted) ** 2).sum())
    smooth = None
    if power > NOISE_TRUSTED * weighted.size and len(weighted) > 1:
        lag_product = float((weighted[1:] * weighted[:-1].conj()).real.sum()) * len(weighted) / (len(weighted) - 1)
        smooth = lag_product / (power - weighted.size)
    error, largest_error = (
        float(np.sqrt(max(misfit_power, 0.0) / max(response_power, 1e-300)))
        for misfit_power in (excess_power, max(excess_power, hidden_power))
    )
    return Misfit(error, largest_error, power / max(weighted.size, 1), smooth)


def _lower_noise_bound(variance: FloatArray, unknowns: int) -> float:
    """One-sided lower 95 % bound of the noise power in the residuals, by a normal approximation: the relative variance
    2 / entries counts the scatter of the noise and that of its estimate. variance: noise variance of each entry."""
    total = float(variance.sum())
    entries = total**2 / max(float((variance**2).sum()), 1e-300)  # effective number of entries
    return total * (1 - unknowns / (2 * max(variance.size, 1)) - ONE_SIDED_95 * float(np.sqrt(2 / max(entries, 1.0))))


def misfit_of_estimate(model: IdentifiedModel, estimate: FrequencyResponse) -> Misfit:
    """Misfit of a model on an estimate's reliable lines within its band."""
    lines = weight_lines((estimate,), model.band_hz)
    modelled, all_lines = model_response(model, lines.frequency_hz), np.ones(len(lines), bool)
    return misfit_of(lines, modelled, all_lines, count_unknowns(model.order, *model.D.shape))


def count_unknowns(order: int, p: int, m: int) -> int:
    """Number of identifiable real parameters of a model with p outputs and m inputs."""
    return order * (p + m) + p * m
