"""Clock drift: two clocks of different rate, one for sending the commands and one for sampling the response.

    y(t) = x(t (1 + ppm 1e-6))

The sample with time stamp t was taken at t (1 + ppm 1e-6): later than t for ppm > 0, by a clock that runs slow. A file
may have been resampled from one clock to the other: `interpolated` is the share (0 to 1) of linear interpolation in the
resampling, the rest being band-limited. `with_position` is 1 where the position has the clock of the response and 0
where it has that of the commands. An entry of `catalogue`.
"""

import numpy as np

from equalizer.effects.effect import Effect, OnResponse, Parameter, Values
from equalizer.effects.simulation.interpolated_response import resample_response
from equalizer.effects.starts.evidence import Evidence
from equalizer.effects.starts.response_starts import estimate_lag
from equalizer.signals.signal import FloatArray

WINDOW_S, LEAST_WINDOWS = 2.0, 4
"""Length (s) of the windows in which the time shift is measured, and fewest windows for a slope. Chosen, as are the
limits below."""
LARGEST_SHIFT_S = 0.1
"""Largest time shift (s) of a window, either way, that is searched for."""
LARGEST_PPM = 2e4
"""Largest drift (1e-6): a larger one is taken for a wrong sample rate."""
LEAST_DRIFT_SIGMA = 5.0
"""Least drift, in standard errors, for the effect to be tried, or for a clock of the position to be ruled out."""


def _apply_drift(response: FloatArray, sample_rate_hz: float, channels: tuple[int, ...], values: Values) -> FloatArray:
    """Resample the response (n, p) as a drifting clock samples it: `OnResponse.change`. The channels are ignored: all
    have the same clock."""
    return resample_response(response, 1 + 1e-6 * values["ppm"], 0.0, values.get("interpolated", 0.0))


def _apply_position_drift(position: FloatArray, sample_rate_hz: float, values: Values) -> FloatArray:
    """Resample the position (n, p) as `_apply_drift` does where `with_position` (default 1) is above 0.5, else return
    it unchanged: `OnResponse.on_position`."""
    return _apply_drift(position, sample_rate_hz, (), values) if values.get("with_position", 1.0) > 0.5 else position


def _find_starting_values(evidence: Evidence, channel: int) -> tuple[Values, ...]:
    """Find ppm from the slope of the response's time shift over time. Sets of values with band-limited and with linear
    interpolation, the better fit first: only linear interpolation lowers peaks; each with every possible clock of the
    position (`_list_position_shares`). Empty where the slope is not known, not significant or too large, and for a
    channel above 0 (the clock is common to all)."""
    shift_rate = _estimate_significant_shift_rate(evidence) if channel <= 0 else None
    if shift_rate is None:
        return ()
    starts = [
        {"ppm": -1e6 * shift_rate, "interpolated": linear_share, "with_position": position_share}
        for linear_share in (0.0, 1.0)
        for position_share in _list_position_shares(evidence, shift_rate)
    ]
    return tuple(sorted(starts, key=lambda values: _compute_misfit(evidence, values)))


def _compute_misfit(evidence: Evidence, values: Values) -> float:
    """Compute the sum of squares of the response's residual over the noise, over the samples with `evidence.used` >
    0."""
    drifted_prediction = _apply_drift(evidence.predicted, evidence.sample_rate_hz, (), values)
    return float(np.sum((((evidence.response - drifted_prediction) / evidence.noise) ** 2)[evidence.used > 0]))


def _list_position_shares(evidence: Evidence, response_shift_rate: float) -> tuple[float, ...]:
    """List the values of `with_position` that agree with the slope of the position's time shift within its error, or
    else the nearer: 1 for the response's slope (s per s), 0 for none. (1,) where the slope is not known."""
    position, predicted, noise = evidence.position, evidence.predicted_position, evidence.position_noise
    if position is None or predicted is None or noise is None:
        return (1.0,)
    rate_and_error = _estimate_shift_rate(evidence, position / noise, predicted / noise)
    if rate_and_error is None:
        return (1.0,)
    shift_rate, standard_error = rate_and_error
    distances = {1.0: abs(shift_rate - response_shift_rate), 0.0: abs(shift_rate)}
    largest_distance = max(LEAST_DRIFT_SIGMA * standard_error, min(distances.values()))
    return tuple(share for share, distance in distances.items() if distance <= largest_distance)


def _estimate_significant_shift_rate(evidence: Evidence) -> float | None:
    """Estimate the slope of the response's time shift (s per s, equal to -1e-6 ppm); None where it is not known, not
    significant, or not below `LARGEST_PPM`."""
    rate_and_error = _estimate_shift_rate(
        evidence, evidence.response / evidence.noise, evidence.predicted / evidence.noise
    )
    if rate_and_error is None:
        return None
    shift_rate, standard_error = rate_and_error
    return (
        shift_rate
        if abs(shift_rate) > LEAST_DRIFT_SIGMA * standard_error and abs(shift_rate) < 1e-6 * LARGEST_PPM
        else None
    )


def _estimate_shift_rate(evidence: Evidence, measured: FloatArray, predicted: FloatArray) -> tuple[float, float] | None:
    """Estimate the slope of the time shift over time (s per s; Theil-Sen estimator), and its standard error from the
    scaled median absolute deviation of the residuals. None for fewer than `LEAST_WINDOWS` windows in which more than
    half of the samples are used and the prediction is not zero, and for a sample period above `LARGEST_SHIFT_S`.
    measured, predicted: (n, channels), over the noise."""
    sample_rate_hz = evidence.sample_rate_hz
    window_samples = int(WINDOW_S * sample_rate_hz)
    if LARGEST_SHIFT_S * sample_rate_hz < 1:
        return None
    window_times_s, shifts_s = [], []
    for start in range(0, len(measured) - window_samples + 1, window_samples):
        window = slice(start, start + window_samples)
        if evidence.used[window].mean() > 0.5 and np.any(predicted[window]):
            window_times_s.append((start + 0.5 * window_samples) / sample_rate_hz)
            shifts_s.append(
                estimate_lag(measured[window], predicted[window], int(LARGEST_SHIFT_S * sample_rate_hz))
                / sample_rate_hz
            )
    if len(window_times_s) < LEAST_WINDOWS:
        return None
    # Windows with almost no motion give arbitrary shifts; the median of pairwise slopes is robust against them.
    times_s, time_shifts_s = np.array(window_times_s), np.array(shifts_s)
    earlier, later = np.triu_indices(len(times_s), 1)
    shift_rate = float(np.median((time_shifts_s[later] - time_shifts_s[earlier]) / (times_s[later] - times_s[earlier])))
    residual = time_shifts_s - shift_rate * times_s
    # 1.5: rounded 1.4826, which makes the median absolute deviation a standard deviation for normal residuals.
    residual_sd = 1.5 * float(np.median(np.abs(residual - np.median(residual))))
    return shift_rate, residual_sd / (np.sqrt(len(times_s)) * float(times_s.std()))


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
    action=OnResponse(_apply_drift, stage=4, on_position=_apply_position_drift),
    starts=_find_starting_values,
    of_time=True,
    sites=("all",),
)
