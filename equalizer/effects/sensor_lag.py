"""Sensor lag: the first-order low pass of a sensor channel has a bandwidth that differs from the model's.

    dy/dt = 2 pi f (x - y)        f: bandwidth (-3 dB) in Hz, used instead of the model's

The sensor model applies it (`simulation.sensor_path.low_pass`, discrete at the sample rate).
"""

import math

import numpy as np

from equalizer.effects.effect import Effect, OnResponse, Parameter, Values
from equalizer.effects.simulation.sensor_path import low_pass, undo_low_pass
from equalizer.effects.starts.evidence import Evidence
from equalizer.effects.starts.response_starts import likeliest_reading
from equalizer.signals.signal import FloatArray

SLOWEST, FASTEST = 0.002, 1.5
"""Range of bandwidths that are searched, as shares of the sample rate."""


def _keep_response(
    response: FloatArray, sample_rate_hz: float, channels: tuple[int, ...], values: Values
) -> FloatArray:
    """The response unchanged: the effect acts through the bandwidth of the sensor model's low pass."""
    return response


def _bandwidth_hz(known_hz: float, values: Values) -> float:
    """Bandwidth of the channel in Hz; that of the model where the value is infinite (no effect)."""
    return known_hz if math.isinf(values["bandwidth"]) else values["bandwidth"]


def _starts(evidence: Evidence, channel: int) -> tuple[Values, ...]:
    """The bandwidth that fits the measured response best in place of the model's; empty where none improves the
    fit."""
    rate, known_hz = evidence.sample_rate_hz, evidence.model.sensor.bandwidth_hz
    bandwidth = likeliest_reading(
        evidence,
        channel,
        lambda samples, value: low_pass(undo_low_pass(samples, rate, known_hz), rate, value),
        list(np.geomspace(SLOWEST * rate, FASTEST * rate, 10)),
    )
    return () if bandwidth is None else ({"bandwidth": bandwidth},)


EFFECT = Effect(
    name="sensor_lag",
    equation="y' = 2 pi bandwidth (x - y), instead of the model's bandwidth",
    source="Analog Devices ADXL335 data sheet: bandwidth set by an RC filter of 32 kOhm +-15 %",
    signature="the response falls short and late at high frequencies, at every level alike, while the position agrees",
    parameters=(Parameter("bandwidth", 1e-2, 1e5, none=math.inf),),
    action=OnResponse(_keep_response, bandwidth_hz=_bandwidth_hz),
    starts=_starts,
    sites=("all", "one"),
)
