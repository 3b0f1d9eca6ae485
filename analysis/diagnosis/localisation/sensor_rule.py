"""Position clean but response off means the response's sensor: no force moves one without the other."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from analysis.diagnosis.localisation.residual_spectra import ResidualSpectra

_TELLING = 4.0
"""Times the noise that a residual must bring to the other sensor before its absence there says something."""
_LOUD = 10.0
"""Times its own noise, on a line, that the response's residual must be."""
_LEAST_LINES = 5
_ABSENT, _PRESENT = 0.1, 0.5
"""Share of what the response's residual would be in position, below which it is absent and above which it is there."""


@dataclass(frozen=True, slots=True)
class SensorRule:
    verdict: Literal["response sensor", "motion", "undecided"]
    expected: float
    """What the response's residual would leave in position if the device moved so, in units of position's noise
    (power), on the lines where that would be seen."""
    seen: float
    """What is there, likewise, noise taken out."""


def sensor_rule(spectra: ResidualSpectra, derivative: int) -> SensorRule | None:
    """derivative: which of position the response is. None without position of as many channels as the response."""
    p = spectra.responses
    if spectra.residual.shape[2] != 2 * p:
        return None
    per_position = (2 * np.pi * spectra.frequency_hz) ** (2 * derivative)
    response, position = np.abs(spectra.residual[:, :, :p]) ** 2, np.abs(spectra.residual[:, :, p:]) ** 2
    noise = spectra.noise[:, :, p:]
    moved = np.maximum(response - spectra.noise[:, :, :p], 0.0) / per_position[:, None]
    telling = (moved > _TELLING * noise) & (response > _LOUD * spectra.noise[:, :, :p])
    if telling.sum() < _LEAST_LINES:
        return SensorRule("undecided", 0.0, 0.0)
    expected = float(np.mean((moved / noise)[telling]))
    seen = float(np.mean(((position - noise) / noise)[telling]))
    # Per line, so that a few strong lines do not speak for all.
    share = float(np.median(np.clip((position - noise)[telling] / moved[telling], 0, 2)))
    if share < _ABSENT:
        return SensorRule("response sensor", expected, seen)
    return SensorRule("motion" if share > _PRESENT else "undecided", expected, seen)
