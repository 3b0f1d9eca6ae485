"""Clock drift: two clocks of different rate, one for sending the commands and one for sampling the response.

    y(t) = x(t (1 + ppm 1e-6))

The sample with time stamp t was taken at t (1 + ppm 1e-6): later than t for ppm > 0, by a clock that runs slow. A file
may have been resampled from one clock to the other: `interpolated` is the share (0 to 1) of linear interpolation in the
resampling; the rest is band-limited and does not change the spectrum. `with_position` is 1 where the position has the
clock of the response and 0 where it has that of the commands.
"""

import numpy as np

from equalizer.effects.effect import Effect, OnResponse, Parameter, Values
from equalizer.effects.simulation.interpolated_response import resample_response
from equalizer.effects.starts.evidence import Evidence
from equalizer.effects.starts.response_starts import lateness
from equalizer.signals.signal import FloatArray

WINDOW_S, LEAST_WINDOWS = 2.0, 4
"""Length (s) of the windows in which the time shift is measured, and fewest windows for a slope."""
LONGEST_S = 0.1
"""Largest time shift (s) of a window that is searched for."""
LARGEST_PPM = 2e4
"""Largest drift (1e-6): a larger one is taken for a wrong sample rate."""
LEAST_SIGMA = 5.0
"""Least drift, in standard errors, from which the effect is tried."""


def _read_drifting(
    response: FloatArray, sample_rate_hz: float, channels: tuple[int, ...], values: Values
) -> FloatArray:
    return resample_response(response, 1 + 1e-6 * values["ppm"], 0.0, values.get("interpolated", 0.0))


def _read_position(position: FloatArray, sample_rate_hz: float, values: Values) -> FloatArray:
    return _read_drifting(position, sample_rate_hz, (), values) if values.get("with_position", 1.0) > 0.5 else position


def _starts(evidence: Evidence, channel: int) -> tuple[Values, ...]:
    """ppm from the slope of the response's time shift over time; the better fit of linear and band-limited
    interpolation first, because only linear interpolation lowers peaks. Empty where the slope is not significant."""
    slope = _lateness_per_second(evidence) if channel <= 0 else None
    if slope is None:
        return ()
    with_position = _position_drift_flag(evidence, slope)
    starts = [
        {"ppm": -1e6 * slope, "interpolated": linear_share, "with_position": with_position}
        for linear_share in (0.0, 1.0)
    ]
    return tuple(sorted(starts, key=lambda values: _misfit(evidence, values)))


def _misfit(evidence: Evidence, values: Values) -> float:
    """Sum of squares of the response's residual over the noise."""
    read = _read_drifting(evidence.predicted, evidence.sample_rate_hz, (), values)
    return float(np.sum((((evidence.response - read) / evidence.noise) ** 2)[evidence.used > 0]))


def _position_drift_flag(evidence: Evidence, slope: float) -> float:
    """1 where the measured position has the same clock error as the response, 0 where it is read by the commands'
    clock."""
    if evidence.position is None or evidence.predicted_position is None or evidence.position_noise is None:
        return 1.0
    noise = evidence.position_noise
    position_slope = _lateness_slope(evidence, evidence.position / noise, evidence.predicted_position / noise)
    return 1.0 if position_slope is None or abs(position_slope[0] - slope) < abs(position_slope[0]) else 0.0


def _lateness_per_second(evidence: Evidence) -> float | None:
    """Slope of the response's time shift (s per s, equal to -1e-6 ppm); None where it is not significant or too
    large."""
    slope_and_error = _lateness_slope(evidence, evidence.response / evidence.noise, evidence.predicted / evidence.noise)
    if slope_and_error is None:
        return None
    slope, standard_error = slope_and_error
    return slope if abs(slope) > LEAST_SIGMA * standard_error and abs(slope) < 1e-6 * LARGEST_PPM else None


def _lateness_slope(evidence: Evidence, measured: FloatArray, predicted: FloatArray) -> tuple[float, float] | None:
    """Slope of the time shift over time (Theil-Sen estimator), and its standard error from the scaled median absolute
    deviation of the residuals; None with too few windows. measured, predicted: (n, channels), over the noise."""
    rate = evidence.sample_rate_hz
    length = int(WINDOW_S * rate)
    if LONGEST_S * rate < 1:
        return None
    window_times_s, shifts_s = [], []
    for start in range(0, len(measured) - length + 1, length):
        window = slice(start, start + length)
        if evidence.used[window].mean() > 0.5 and np.any(predicted[window]):
            window_times_s.append((start + 0.5 * length) / rate)
            shifts_s.append(lateness(measured[window], predicted[window], int(LONGEST_S * rate)) / rate)
    if len(window_times_s) < LEAST_WINDOWS:
        return None
    # Windows with almost no motion give arbitrary shifts; the median of pairwise slopes is robust against them.
    times_s, time_shifts_s = np.array(window_times_s), np.array(shifts_s)
    first, second = np.triu_indices(len(times_s), 1)
    slope = float(np.median((time_shifts_s[second] - time_shifts_s[first]) / (times_s[second] - times_s[first])))
    residual = time_shifts_s - slope * times_s
    spread = 1.5 * float(np.median(np.abs(residual - np.median(residual))))
    return slope, spread / (np.sqrt(len(times_s)) * float(times_s.std()))


EFFECT = Effect(
    name="clock_drift",
    equation="y(t) = x(t (1 + ppm 1e-6))",
    source="IEEE Std 1139, fractional frequency offset of an oscillator",
    signature="the measured response is later (or earlier) than predicted, by an amount that grows in proportion to "
    "time",
    parameters=(
        Parameter("ppm", -LARGEST_PPM, LARGEST_PPM, none=0.0, scale="linear", step=0.1),
        Parameter("interpolated", 0.0, 1.0, none=None, scale="linear", step=0.05),
        Parameter("with_position", 0.0, 1.0, none=None, scale="linear", step=1.0, fixed=True),
    ),
    action=OnResponse(_read_drifting, stage=4, on_position=_read_position),
    starts=_starts,
    of_time=True,
    sites=("all",),
)
