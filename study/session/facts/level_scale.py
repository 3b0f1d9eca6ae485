"""Meaning of a level where stimuli are equalized: a target acceleration, equal for both directions.

Levels remain forces in newtons, so that cap, steps and rules do not change: a level is the larger of the two forces
that the directions need for the same acceleration. Both directions therefore reach the cap at the same acceleration.
The facts are written into the log when a session is opened.
"""

from pydantic.dataclasses import dataclass

from study.session.facts.fact_types import FileName, FrequencyHz, Magnitude, Positive, Sha256
from study.session.facts.sitting_events import FACT_CONFIG


@dataclass(frozen=True, config=FACT_CONFIG)
class LevelScale:
    """Relation of level and acceleration at one frequency."""

    frequency_hz: FrequencyHz
    n_per_mps2: Positive
    """Level for a target acceleration of 1 m/s² (N per m/s²)."""
    reachable_mps2: Magnitude
    """Acceleration at the cap of the staircase, in either direction (m/s²)."""


@dataclass(frozen=True, config=FACT_CONFIG)
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


def convert_level_to_acceleration(
    equalized: EqualizedFacts | None, level_n: float, frequency_hz: float
) -> float | None:
    """Convert a level (N) to the acceleration (m/s^2) that it stands for; None where levels are commanded forces.
    Raises ValueError for a frequency without a scale."""
    if equalized is None:
        return None
    level_scale = next(
        (level_scale for level_scale in equalized.levels if level_scale.frequency_hz == frequency_hz), None
    )
    if level_scale is None:
        raise ValueError(f"the session has no scale of levels for {frequency_hz} Hz")
    return level_n / level_scale.n_per_mps2


def convert_level_to_amplitude(equalized: EqualizedFacts | None, level_n: float, frequency_hz: float) -> float:
    """Convert a level (N) to the amplitude of the stimulus: a force (N) without an equalizer, an acceleration (m/s^2)
    with one. Raises ValueError for a frequency without a scale."""
    acceleration_mps2 = convert_level_to_acceleration(equalized, level_n, frequency_hz)
    return level_n if acceleration_mps2 is None else acceleration_mps2
