"""Comparison of all methods to compute forces at all places, as a table."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from equalizer.identification.frequency_response.frequency_response import FrequencyResponse
from equalizer.plant.identified_model import IdentifiedModel
from equalizer.signals.signal import ComplexArray, FloatArray
from equalizer.tracking.feedforward.baselines import (
    Inverse,
    acceleration_matching,
    make_identified_inverse,
    no_equalization,
    raw_estimate,
    rigid_body,
    static_gain,
)
from equalizer.tracking.feedforward.quality import Quality, measure_quality


@dataclass(frozen=True, slots=True)
class ComparisonRow:
    """Quality of an inverse at a place: its name, the place's name, and its computing cost."""

    name: str
    where: str
    quality: Quality
    multiply_adds: int
    """Multiply-adds per sample."""


def baseline_inverses(
    model: IdentifiedModel, measured: FrequencyResponse, frequency_hz: FloatArray
) -> tuple[Inverse, ...]:
    """All baseline inverses from the data of one place, the identified model's last."""
    return (
        no_equalization(model, frequency_hz),
        static_gain(model, frequency_hz),
        acceleration_matching(model, frequency_hz),
        rigid_body(model, frequency_hz),
        raw_estimate(measured, frequency_hz),
        make_identified_inverse(model, frequency_hz),
    )


def compare(
    inverses: Sequence[Inverse],
    responses: Mapping[str, ComplexArray],
    only_at: Mapping[str, Sequence[Inverse]] | None = None,
) -> tuple[ComparisonRow, ...]:
    """Quality of each inverse at each place. responses: the true ones by place, (lines, p, m) at the inverses' lines.
    `only_at`: inverses that were made for one place, such as the interpolated model's at the edge."""
    rows = []
    for where, response in responses.items():
        for inverse in (*inverses, *(only_at or {}).get(where, ())):
            delivered = np.asarray(response @ inverse.response)
            rows.append(ComparisonRow(inverse.name, where, measure_quality(delivered), inverse.multiply_adds))
    return tuple(rows)
