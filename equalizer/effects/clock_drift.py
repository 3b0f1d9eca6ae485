"""Clock drift: commands are sent and responses sampled by two clocks of different rate.

y(t) = x(t (1 + ppm 1e-6)): the sample that carries the time t was taken later, at t (1 + ppm 1e-6), where ppm > 0, by a
clock that runs slow. A file may have been resampled from one clock to the other: `interpolated` is the share of linear
interpolation in that (0: band-limited, which leaves the spectrum alone), `with_position` whether the position has the
response's clock (1) or the commands' (0).
"""

import numpy as np

from equalizer.effects.effect import Effect, OnResponse, Parameter, Values
from equalizer.effects.simulation.interpolated_response import read_other_times
from equalizer.effects.starts.evidence import Evidence
from equalizer.effects.starts.response_starts import lateness
from equalizer.signals.signal import FloatArray

WINDOW_S, LEAST_WINDOWS = 2.0, 4
"""Length of the windows in which the delay is measured, and fewest of them for a slope."""
LONGEST_S = 0.1
"""Largest time shift (s) of a window that is searched for."""
LARGEST_PPM = 2e4
"""Largest drift: beyond it the sample rate is wrong, not the clock."""
LEAST_SIGMA = 5.0
"""Least drift, in its standard errors, for the effect to be tried."""


def _read_drifting(
    response: FloatArray, sample_rate_hz: float, channels: tuple[int, ...], values: Values
) -> FloatArray:
    return read_other_times(response, 1 + 1e-6 * values["ppm"], 0.0, values.get("interpolated", 0.0))


def _read_position(position: FloatArray, sample_rate_hz: float, values: Values) -> FloatArray:
    return _read_drifting(position, sample_rate_hz, (), values) if values.get("with_position", 1.0) > 0.5 else position


def _starts(evidence: Evidence, channel: int) -> tuple[Values, ...]:
    """The slope of the response's time shift over time, window by window. Linear interpolation lowers peaks, which a
    real clock error does not: linear and band-limited interpolation are both tried."""
    slope = _lateness_per_second(evidence) if channel <= 0 else None
    if slope is None:
        return ()
    with_position = _position_drifts_along(evidence, slope)
    starts = [
        {"ppm": -1e6 * slope, "interpolated": straight, "with_position": with_position} for straight in (0.0, 1.0)
    ]
    return tuple(sorted(starts, key=lambda values: _misfit(evidence, values)))


def _misfit(evidence: Evidence, values: Values) -> float:
    read = _read_drifting(evidence.predicted, evidence.sample_rate_hz, (), values)
    return float(np.sum((((evidence.response - read) / evidence.noise) ** 2)[evidence.used > 0]))


def _position_drifts_along(evidence: Evidence, slope: float) -> float:
    """1 where the measured position has the same clock error as the response, 0 where it is read by the commands'
    clock."""
    if evidence.position is None or evidence.predicted_position is None or evidence.position_noise is None:
        return 1.0
    noise = evidence.position_noise
    own = _lateness_slope(evidence, evidence.position / noise, evidence.predicted_position / noise)
    return 1.0 if own is None or abs(own[0] - slope) < abs(own[0]) else 0.0


def _lateness_per_second(evidence: Evidence) -> float | None:
    found = _lateness_slope(evidence, evidence.response / evidence.noise, evidence.predicted / evidence.noise)
    if found is None:
        return None
    slope, error = found
    return slope if abs(slope) > LEAST_SIGMA * error and abs(slope) < 1e-6 * LARGEST_PPM else None


def _lateness_slope(evidence: Evidence, measured: FloatArray, predicted: FloatArray) -> tuple[float, float] | None:
    """Slope of the time shift over time (Theil-Sen estimator), and its standard error; None with too few windows."""
    rate = evidence.sample_rate_hz
    length = int(WINDOW_S * rate)
    if LONGEST_S * rate < 1:
        return None
    at, late = [], []
    for start in range(0, len(measured) - length + 1, length):
        inside = slice(start, start + length)
        if evidence.used[inside].mean() > 0.5 and np.any(predicted[inside]):
            at.append((start + 0.5 * length) / rate)
            late.append(lateness(measured[inside], predicted[inside], int(LONGEST_S * rate)) / rate)
    if len(at) < LEAST_WINDOWS:
        return None
    # Windows with almost no motion give arbitrary shifts; the median of pairwise slopes is robust against them.
    when, by = np.array(at), np.array(late)
    first, second = np.triu_indices(len(when), 1)
    slope = float(np.median((by[second] - by[first]) / (when[second] - when[first])))
    rest = by - slope * when
    spread = 1.5 * float(np.median(np.abs(rest - np.median(rest))))
    return slope, spread / (np.sqrt(len(when)) * float(when.std()))


EFFECT = Effect(
    name="clock_drift",
    equation="y(t) = x(t (1 + ppm 1e-6))",
    source="IEEE Std 1139, fractional frequency offset of an oscillator",
    signature="what is measured comes later and later, or earlier and earlier, than predicted, by an amount that grows "
    "evenly with time",
    parameters=(
        Parameter("ppm", -LARGEST_PPM, LARGEST_PPM, none=0.0, scale="linear", step=0.1),
        Parameter("interpolated", 0.0, 1.0, none=None, scale="linear", step=0.05),
        Parameter("with_position", 0.0, 1.0, none=None, scale="linear", step=1.0, fixed=True),
    ),
    acts=OnResponse(_read_drifting, stage=4, on_position=_read_position),
    starts=_starts,
    of_time=True,
    sites=("all",),
)
