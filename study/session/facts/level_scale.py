"""Meaning of a level where stimuli are equalized: a wanted acceleration, equal for both directions.

Levels remain forces in newtons, so that cap, steps and rules do not change: a level is the larger of the two forces
that the directions need for the same acceleration. Both directions therefore reach the cap at the same acceleration.
"""

from pydantic.dataclasses import dataclass

from study.session.facts.fact_types import FileName, FrequencyHz, Magnitude, Positive, Sha256
from study.session.facts.sitting_events import FACT


@dataclass(frozen=True, config=FACT)
class LevelScale:
    """Relation of level and acceleration at one frequency."""

    frequency_hz: FrequencyHz
    n_per_mps2: Positive
    """Level for a wanted acceleration of 1 m/s²."""
    reachable_mps2: Magnitude
    """Acceleration at the cap of the staircase, in either direction."""


@dataclass(frozen=True, config=FACT)
class EqualizedFacts:
    """The equalizer of a session's stimuli."""

    model: FileName
    """File of the model in the session folder."""
    sha256: Sha256
    """SHA-256 of that file."""
    levels: tuple[LevelScale, ...]
    """Scales, one per frequency that may be played."""
    quality: str = ""
    """Errors of the model, and how they were measured, in words; empty in logs of earlier versions."""


def acceleration_of_level(equalized: EqualizedFacts | None, level_n: float, frequency_hz: float) -> float | None:
    """Acceleration (m/s^2) that a level (N) stands for; None where levels are commanded forces. Raises ValueError
    for a frequency without a scale."""
    if equalized is None:
        return None
    scale = next((scale for scale in equalized.levels if scale.frequency_hz == frequency_hz), None)
    if scale is None:
        raise ValueError(f"the session has no scale of levels for {frequency_hz} Hz")
    return level_n / scale.n_per_mps2


def equalizer_amplitude(equalized: EqualizedFacts | None, level_n: float, frequency_hz: float) -> float:
    """Amplitude of a level in the unit of the input: N without an equalizer, m/s^2 with one. Raises ValueError for a
    frequency without a scale."""
    acceleration_mps2 = acceleration_of_level(equalized, level_n, frequency_hz)
    return level_n if acceleration_mps2 is None else acceleration_mps2
