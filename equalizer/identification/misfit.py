"""What a model leaves of the lines beyond their noise: how much, and whether it runs smoothly from line to line."""

from dataclasses import dataclass

import numpy as np

from equalizer.identification.frequency_response import BoolArray, FrequencyResponse
from equalizer.identification.weighted_lines import WeightedLines, weighted_lines
from equalizer.plant.identified_model import IdentifiedModel
from equalizer.plant.model_response import model_response
from equalizer.signals.lockin import ComplexArray

NOISE_TRUSTED = 1.1
"""The noise power of an estimate is itself estimated, from few looks: below this factor nothing is said to be left."""


@dataclass(frozen=True, slots=True)
class Misfit:
    error: float
    """Root mean square of model - estimate beyond the noise, relative to the response's; 0 where only noise is left."""
    cost: float
    """Squared difference over noise variance, mean over all entries of the lines: about 1 at the noise."""
    smooth: float | None
    """Correlation of what is left beyond the noise between neighbouring lines: near 1 for a linear answer that the
    model lacks, near 0 for lines that scatter; None where only noise is left, or where the noise itself was judged
    by the scatter of the lines."""


def misfit_of(lines: WeightedLines, modelled: ComplexArray, inside: BoolArray) -> Misfit:
    """modelled: (lines, p, m). inside: (lines,), those that count."""
    left = (modelled - lines.response)[inside]
    weight = lines.weight[inside]
    size = float((np.abs(lines.response[inside]) ** 2).sum())
    beyond = float((np.abs(left) ** 2).sum() - NOISE_TRUSTED * (1 / weight**2).sum())
    weighted = weight * left
    power = float((np.abs(weighted) ** 2).sum())
    smooth = None
    if power > NOISE_TRUSTED * weighted.size and len(weighted) > 1:
        both = float((weighted[1:] * weighted[:-1].conj()).real.sum()) * len(weighted) / (len(weighted) - 1)
        smooth = both / (power - weighted.size)
    return Misfit(float(np.sqrt(max(beyond, 0.0) / max(size, 1e-300))), power / max(weighted.size, 1), smooth)


def misfit_of_estimate(model: IdentifiedModel, estimate: FrequencyResponse) -> Misfit:
    """Of the reliable lines in the model's band."""
    lines = weighted_lines((estimate,), model.band_hz)
    return misfit_of(lines, model_response(model, lines.frequency_hz), np.ones(len(lines), bool))
