"""Constant time offset between two data loggers: the response is recorded late or early, the position is not.

y(t) = x(t - offset). The offset may be a fraction of a sample; the logger may have interpolated linearly between
samples, which attenuates high frequencies.
"""

import numpy as np

from equalizer.effects.effect import Effect, OnResponse, Parameter, Values
from equalizer.effects.simulation.interpolated_response import resample_response
from equalizer.effects.starts.evidence import Evidence
from equalizer.effects.starts.response_starts import lateness
from equalizer.signals.signal import FloatArray

LONGEST_S = 1.0
"""Largest offset between the loggers (s), of either sign. By hand."""
LEAST_SAMPLES = 1e-3
"""Least offset that is tried (samples): below it, the estimate by cross-correlation is not worth a fit. By hand."""


def _read_shifted(response: FloatArray, sample_rate_hz: float, channels: tuple[int, ...], values: Values) -> FloatArray:
    """The response (n, c), delayed by `offset` seconds. `interpolated`: share (0 to 1) of linear interpolation between
    samples; the rest is band-limited (windowed sinc). `channels` is not used: all are delayed alike."""
    return resample_response(response, 1.0, -values["offset"] * sample_rate_hz, values.get("interpolated", 0.0))


def _starts(evidence: Evidence, channel: int) -> tuple[Values, ...]:
    """Starting values: the lag of the measured response behind the predicted one, by cross-correlation weighted with
    the noise, with linear and with band-limited interpolation, that of the smaller misfit first."""
    if channel > 0:
        return ()
    weight = evidence.used[:, None] / evidence.noise
    longest = min(int(LONGEST_S * evidence.sample_rate_hz), len(weight) // 2)
    lag_samples = lateness(evidence.response * weight, evidence.predicted * weight, longest)
    if abs(lag_samples) <= LEAST_SAMPLES:
        return ()
    # Linear interpolation between samples attenuates high frequencies, band-limited interpolation does not.
    starts = [
        {"offset": lag_samples / evidence.sample_rate_hz, "interpolated": linear_share} for linear_share in (0.0, 1.0)
    ]
    return tuple(sorted(starts, key=lambda values: _misfit(evidence, values)))


def _misfit(evidence: Evidence, values: Values) -> float:
    """Sum of squared residuals of the shifted prediction over the samples in use, in units of the noise."""
    read = _read_shifted(evidence.predicted, evidence.sample_rate_hz, (), values)
    return float(np.sum((((evidence.response - read) / evidence.noise) ** 2)[evidence.used > 0]))


EFFECT = Effect(
    name="logger_offset",
    equation="y(t) = x(t - offset)",
    source="Oppenheim and Schafer, Discrete-Time Signal Processing, ch. 4: a delay by part of a sample",
    signature="the response's phase is off in proportion to frequency, at every level alike, while the position agrees",
    parameters=(
        Parameter("offset", -LONGEST_S, LONGEST_S, none=0.0, scale="linear", step=1e-5),
        Parameter("interpolated", 0.0, 1.0, none=None, scale="linear", step=0.05),
    ),
    action=OnResponse(_read_shifted, stage=4),
    starts=_starts,
    sites=("all",),
)
