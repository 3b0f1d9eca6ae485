"""Two clocks of unlike speed: one sends commands, the other samples what comes of them."""

import numpy as np

from equalizer.effects.effect import Effect, OnResponse, Parameter, Values
from equalizer.effects.evidence import Evidence
from equalizer.effects.other_times import read_other_times
from equalizer.effects.response_starts import lateness
from equalizer.signals.signal import FloatArray

WINDOW_S, LEAST_WINDOWS = 2.0, 4
LONGEST_S = 0.1
"""By which a window may be off."""
LARGEST_PPM = 2e4
LEAST_SIGMA = 5.0


def _read(response: FloatArray, sample_rate_hz: float, channels: tuple[int, ...], of: Values) -> FloatArray:
    return read_other_times(response, 1 + 1e-6 * of["ppm"], 0.0, of.get("interpolated", 0.0))


def _starts(evidence: Evidence, channel: int) -> tuple[Values, ...]:
    """The slope of how late the response comes, window by window. A straight line between samples loses height where
    a real clock does not: both are tried."""
    slope = _lateness_per_second(evidence) if channel <= 0 else None
    if slope is None:
        return ()
    starts = [{"ppm": -1e6 * slope, "interpolated": straight} for straight in (0.0, 1.0)]
    return tuple(sorted(starts, key=lambda values: _misfit(evidence, values)))


def _misfit(evidence: Evidence, values: Values) -> float:
    read = _read(evidence.predicted, evidence.sample_rate_hz, (), values)
    return float(np.sum((((evidence.response - read) / evidence.noise) ** 2)[evidence.used > 0]))


def _lateness_per_second(evidence: Evidence) -> float | None:
    rate = evidence.sample_rate_hz
    length = int(WINDOW_S * rate)
    measured, predicted = evidence.response / evidence.noise, evidence.predicted / evidence.noise
    found: list[tuple[float, float, float]] = []
    for start in range(0, len(measured) - length + 1, length):
        inside = slice(start, start + length)
        size = float(np.sum(predicted[inside] ** 2))
        if evidence.used[inside].all() and size > 0:
            late = lateness(measured[inside], predicted[inside], int(LONGEST_S * rate)) / rate
            found.append(((start + 0.5 * length) / rate, late, size))
    if len(found) < LEAST_WINDOWS:
        return None
    at, late, _ = np.array(found).T
    # Windows in which nearly nothing moved are off by anything: pairwise slopes have a median that does not mind.
    first, second = np.triu_indices(len(at), 1)
    slopes = (late[second] - late[first]) / (at[second] - at[first])
    slope = float(np.median(slopes))
    rest = late - slope * at
    spread = 1.5 * float(np.median(np.abs(rest - np.median(rest))))
    error = spread / (np.sqrt(len(at)) * float(at.std()))
    return slope if abs(slope) > LEAST_SIGMA * error and abs(slope) < 1e-6 * LARGEST_PPM else None


EFFECT = Effect(
    name="clock_drift",
    equation="y(t) = x(t (1 + ppm 1e-6))",
    source="IEEE Std 1139, fractional frequency offset of an oscillator",
    signature="what is measured comes later and later, or earlier and earlier, than predicted, by an amount that grows "
    "evenly with time",
    parameters=(
        Parameter("ppm", -LARGEST_PPM, LARGEST_PPM, none=0.0, scale="linear", step=0.1),
        Parameter("interpolated", 0.0, 1.0, none=None, scale="linear", step=0.05),
    ),
    acts=OnResponse(_read, stage=4, shared=True, position_too=True),
    starts=_starts,
    sites=("all",),
)
