"""Time offset of a logger: the response comes late or early by a constant, the position does not."""

import numpy as np

from equalizer.effects.effect import Effect, OnResponse, Parameter, Values
from equalizer.effects.simulation.interpolated_response import read_other_times
from equalizer.effects.starts.evidence import Evidence
from equalizer.effects.starts.response_starts import lateness
from equalizer.signals.signal import FloatArray

LONGEST_S = 1.0
"""Largest offset between the loggers (s), either way. By hand."""
LEAST_SAMPLES = 1e-3
"""Least offset that is tried, in samples; below it the correlation gives no start worth a fit. By hand."""


def _read_shifted(response: FloatArray, sample_rate_hz: float, channels: tuple[int, ...], values: Values) -> FloatArray:
    """(n, c) from (n, c), read `offset` seconds earlier. `interpolated`: share (0 to 1) of linear interpolation with
    which the logger read between its samples; the rest is band-limited."""
    return read_other_times(response, 1.0, -values["offset"] * sample_rate_hz, values.get("interpolated", 0.0))


def _starts(evidence: Evidence, channel: int) -> tuple[Values, ...]:
    if channel > 0:
        return ()
    weight = evidence.used[:, None] / evidence.noise
    longest = min(int(LONGEST_S * evidence.sample_rate_hz), len(weight) // 2)
    late = lateness(evidence.response * weight, evidence.predicted * weight, longest)
    if abs(late) <= LEAST_SAMPLES:
        return ()
    # Linear interpolation between samples lowers peaks where band-limited interpolation does not: both are tried.
    starts = [{"offset": late / evidence.sample_rate_hz, "interpolated": straight} for straight in (0.0, 1.0)]
    return tuple(sorted(starts, key=lambda values: _misfit(evidence, values)))


def _misfit(evidence: Evidence, values: Values) -> float:
    """Sum of squared residuals, in units of the noise, of the shifted prediction over the samples in use."""
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
    acts=OnResponse(_read_shifted, stage=4),
    starts=_starts,
    sites=("all",),
)
