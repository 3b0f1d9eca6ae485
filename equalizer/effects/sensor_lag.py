"""A sensor, or the filter of one channel, that is slower or faster than the model says."""

import math

import numpy as np

from equalizer.effects.effect import Effect, OnResponse, Parameter, Values
from equalizer.effects.simulation.sensor_path import before_low_pass, low_passed
from equalizer.effects.starts.evidence import Evidence
from equalizer.effects.starts.response_starts import likeliest_reading
from equalizer.signals.signal import FloatArray

SLOWEST, FASTEST = 0.002, 1.5
"""Bandwidths worth a try, as shares of the sample rate."""


def _as_filtered(response: FloatArray, sample_rate_hz: float, channels: tuple[int, ...], of: Values) -> FloatArray:
    """The low pass is the model's own, with another bandwidth."""
    return response


def _bandwidth_hz(known_hz: float, of: Values) -> float:
    return known_hz if math.isinf(of["bandwidth"]) else of["bandwidth"]


def _starts(evidence: Evidence, channel: int) -> tuple[Values, ...]:
    rate, known_hz = evidence.sample_rate_hz, evidence.model.sensor.bandwidth_hz
    bandwidth = likeliest_reading(
        evidence,
        channel,
        lambda samples, value: low_passed(before_low_pass(samples, rate, known_hz), rate, value),
        list(np.geomspace(SLOWEST * rate, FASTEST * rate, 10)),
    )
    return () if bandwidth is None else ({"bandwidth": bandwidth},)


EFFECT = Effect(
    name="sensor_lag",
    equation="y' = 2 pi bandwidth (x - y), instead of the model's bandwidth",
    source="Analog Devices ADXL335 data sheet: bandwidth set by an RC filter of 32 kOhm +-15 %",
    signature="the response falls short and late at high frequencies, at every level alike, while the position agrees",
    parameters=(Parameter("bandwidth", 1e-2, 1e5, none=math.inf),),
    acts=OnResponse(_as_filtered, bandwidth_hz=_bandwidth_hz),
    starts=_starts,
    sites=("all", "one"),
)
