"""Constant time offset between two data loggers: the response is recorded late or early, the position is not.

y(t) = x(t - offset). The offset may be a fraction of a sample; the logger may have interpolated linearly between
samples, which attenuates high frequencies. An entry of `equalizer.effects.catalogue`.
"""

import numpy as np

from equalizer.effects.effect import Effect, OnResponse, Parameter, Values
from equalizer.effects.simulation.interpolated_response import resample_response
from equalizer.effects.starts.evidence import Evidence
from equalizer.effects.starts.response_starts import estimate_lag
from equalizer.signals.signal import FloatArray

LARGEST_OFFSET_S = 1.0
"""Largest offset between the loggers (s), of either sign. Chosen."""
SMALLEST_OFFSET_SAMPLES = 1e-3
"""Least offset that is tried (samples): below it, the estimate by cross-correlation is not worth a fit. Chosen."""


def _shift_response(
    response: FloatArray, sample_rate_hz: float, channels: tuple[int, ...], values: Values
) -> FloatArray:
    """Delay the response (n, p) by `offset` seconds. `interpolated`: share (0 to 1) of linear interpolation between
    samples; the rest is band-limited (windowed sinc). `channels` is not used: all are delayed alike."""
    return resample_response(response, 1.0, -values["offset"] * sample_rate_hz, values.get("interpolated", 0.0))


def _find_starting_values(evidence: Evidence, channel: int) -> tuple[Values, ...]:
    """Find starting values: the lag of the measured response behind the predicted one, by cross-correlation weighted
    with the noise, with linear and with band-limited interpolation, the one of the smaller misfit first. Empty for an
    offset of at most `SMALLEST_OFFSET_SAMPLES`, and for channels after the first, because all channels have the same
    offset."""
    if channel > 0:
        return ()
    weight = evidence.used[:, None] / evidence.noise
    largest_lag_samples = min(int(LARGEST_OFFSET_S * evidence.sample_rate_hz), len(weight) // 2)
    lag_samples = estimate_lag(evidence.response * weight, evidence.predicted * weight, largest_lag_samples)
    if abs(lag_samples) <= SMALLEST_OFFSET_SAMPLES:
        return ()
    starts = [
        {"offset": lag_samples / evidence.sample_rate_hz, "interpolated": linear_share} for linear_share in (0.0, 1.0)
    ]
    return tuple(sorted(starts, key=lambda values: _compute_misfit(evidence, values)))


def _compute_misfit(evidence: Evidence, values: Values) -> float:
    """Compute the sum of squared residuals of the shifted prediction over the samples in use, in units of the noise."""
    shifted_response = _shift_response(evidence.predicted, evidence.sample_rate_hz, (), values)
    return float(np.sum((((evidence.response - shifted_response) / evidence.noise) ** 2)[evidence.used > 0]))


EFFECT = Effect(
    name="logger_offset",
    equation="y(t) = x(t - offset)",
    source="Oppenheim and Schafer, Discrete-Time Signal Processing, ch. 4: a delay by part of a sample",
    signature="the response's phase is off in proportion to frequency, at every level alike, while the position agrees",
    parameters=(
        Parameter("offset", -LARGEST_OFFSET_S, LARGEST_OFFSET_S, none=0.0, scale="linear", step=1e-5),
        Parameter("interpolated", 0.0, 1.0, none=None, scale="linear", step=0.05),
    ),
    action=OnResponse(_shift_response, stage=4),
    starts=_find_starting_values,
    sites=("all",),
)
