"""From measured frequency responses to a model: starts, refinement, choice, uncertainty."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from equalizer.identification.candidates import Candidate, best, candidate, subspace_starts
from equalizer.identification.frequency_response import FrequencyResponse
from equalizer.identification.refinement import FittedForm
from equalizer.identification.refusals import lines_or_refusal
from equalizer.identification.settings import IdentificationSettings
from equalizer.identification.weighted_lines import WeightedLines
from equalizer.plant.identified_model import IdentifiedModel
from equalizer.signals.recording import Recording

UNEXPLAINED = 1.5
"""Residual over noise above which a model is said to leave something."""


@dataclass(frozen=True, slots=True, eq=False)
class Identified:
    """A model and how well it fits what was measured."""

    model: IdentifiedModel
    cost: float
    """Squared residual over noise variance, per unknown left free: about 1 when only noise is left."""
    rms_relative_error: float
    """Model against estimate over the lines of the band; the estimate's own noise is in it."""
    worst_relative_error: float
    """The worst line's, relative to the root mean square of the response."""
    lines: int
    candidates: tuple[Candidate, ...]
    chosen: Candidate
    remarks: tuple[str, ...]
    """What the user should know about this model, in sentences."""


def identify(
    response: FrequencyResponse | Sequence[FrequencyResponse],
    settings: IdentificationSettings | None = None,
    records: tuple[Recording, ...] = (),
    on_progress: Callable[[float], None] | None = None,
) -> Identified:
    """One model of all estimates together, each line counting by its noise. Always stable.

    `records` give further starts in the time domain. `on_progress` is told the share done, 0 to 1.
    Raises IdentificationRefused when the data do not carry a model.
    """
    settings = settings or IdentificationSettings()
    tell = on_progress or (lambda _: None)
    responses = (response,) if isinstance(response, FrequencyResponse) else tuple(response)
    lines = lines_or_refusal(responses, settings)
    starts = subspace_starts(lines, settings)
    found = []
    for number, start in enumerate(starts):
        tell(number / len(starts))
        found.append(candidate(start, lines, settings))
    chosen = best(found)
    tell(1.0)
    return _identified(chosen, tuple(found), lines, responses[0], settings)


def _identified(
    chosen: Candidate,
    found: tuple[Candidate, ...],
    lines: WeightedLines,
    like: FrequencyResponse,
    settings: IdentificationSettings,
) -> Identified:
    low, high = settings.band_hz
    p, m = lines.response.shape[1:]
    unknowns = settings.order * (p + m) + p * m
    cost = chosen.cost * lines.response.size / max(lines.response.size - unknowns / 2, 1.0)
    inside = (lines.frequency_hz >= low) & (lines.frequency_hz <= high)
    error = lines.relative_error(chosen.fitted.response(lines.z))[inside]
    return Identified(
        model=_model(chosen.fitted, like, settings),
        cost=cost,
        rms_relative_error=float(np.sqrt((error**2).mean())),
        worst_relative_error=float(error.max()),
        lines=int(inside.sum()),
        candidates=found,
        chosen=chosen,
        remarks=tuple(_remarks(chosen, cost, settings)),
    )


def _remarks(chosen: Candidate, cost: float, settings: IdentificationSettings) -> list[str]:
    remarks = []
    if cost > UNEXPLAINED:
        remarks.append(
            f"the model leaves {np.sqrt(cost):.2g} times the noise: the order {settings.order} may be too low, "
            f"or the device is not linear"
        )
    if not chosen.sane:
        remarks.append(
            f"outside the band the model's gain is {chosen.outside_gain:.3g} times that inside: "
            f"keep what is played within the band, or lower the order"
        )
    return remarks


def _model(fitted: FittedForm, like: FrequencyResponse, settings: IdentificationSettings) -> IdentifiedModel:
    return IdentifiedModel(
        A=fitted.form.state_matrix,
        B=fitted.B,
        C=fitted.form.C,
        D=fitted.D,
        sample_rate_hz=like.sample_rate_hz,
        band_hz=settings.band_hz,
        input_unit=like.input_unit,
        output_unit=like.output_unit,
        input_channels=like.input_channels,
        output_channels=like.output_channels,
        provenance={
            "method": "warped frequency-domain subspace, refined by maximum likelihood",
            "longest_decay_s": settings.longest_decay_s,
        },
    )
