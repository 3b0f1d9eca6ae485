"""A sensor, or the filter of one channel, that is slower than the model says."""

import math

import numpy as np

from equalizer.effects.effect import Effect, OnResponse, Parameter, Values
from equalizer.effects.evidence import Evidence
from equalizer.effects.response_starts import likeliest_reading
from equalizer.effects.sensor_path import low_passed
from equalizer.signals.signal import FloatArray

SLOWEST, FASTEST = 0.002, 1.5
"""Bandwidths worth a try, as shares of the sample rate."""


def _filtered(response: FloatArray, sample_rate_hz: float, channels: tuple[int, ...], of: Values) -> FloatArray:
    if math.isinf(of["bandwidth"]):
        return response
    read = response.copy()
    read[:, channels] = low_passed(response[:, channels], sample_rate_hz, of["bandwidth"])
    return read


def _starts(evidence: Evidence, channel: int) -> tuple[Values, ...]:
    rate = evidence.sample_rate_hz
    bandwidth = likeliest_reading(
        evidence,
        channel,
        lambda samples, value: low_passed(samples, rate, value),
        list(np.geomspace(SLOWEST * rate, FASTEST * rate, 10)),
    )
    return () if bandwidth is None else ({"bandwidth": bandwidth},)


EFFECT = Effect(
    name="sensor_lag",
    equation="y' = 2 pi bandwidth (x - y)",
    source="Analog Devices ADXL335 data sheet: bandwidth set by an RC filter of 32 kOhm +-15 %",
    signature="the response falls short and late at high frequencies, at every level alike, while the position agrees",
    parameters=(Parameter("bandwidth", 1e-2, 1e5, none=math.inf),),
    acts=OnResponse(_filtered),
    starts=_starts,
    sites=("all", "one"),
)
