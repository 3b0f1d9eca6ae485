"""Sensor lag: the first-order low pass of a sensor channel has a bandwidth that differs from the model's.

    dy/dt = 2 pi f (x - y)        f: bandwidth (-3 dB) in Hz, used instead of the model's

with x the true response and y the reading. The sensor model applies the low pass (`simulation.sensor_path`, discrete at
the sample rate). `equalizer.effects.catalogue` lists the effect.
"""

import math

import numpy as np

from equalizer.effects.effect import Effect, OnResponse, Parameter, Values
from equalizer.effects.simulation.sensor_path import apply_low_pass, undo_low_pass
from equalizer.effects.starts.evidence import Evidence
from equalizer.effects.starts.response_starts import find_response_parameter
from equalizer.signals.signal import FloatArray

LOWEST_BANDWIDTH_SHARE, HIGHEST_BANDWIDTH_SHARE = 0.002, 1.5
"""Lowest and highest bandwidth tried for a starting value, over the sample rate. Chosen: 2 Hz to 1.5 kHz at
a sample rate of 1 kHz."""


def _keep_response(
    response: FloatArray, sample_rate_hz: float, channels: tuple[int, ...], values: Values
) -> FloatArray:
    """Return the response (n, p) unchanged: the effect acts through the bandwidth of the sensor model's low pass."""
    return response


def _replace_bandwidth_hz(model_bandwidth_hz: float, values: Values) -> float:
    """Replace the model's bandwidth of a channel by that of the effect, both in Hz; the model's is kept where the value
    is infinite (no effect)."""
    return model_bandwidth_hz if math.isinf(values["bandwidth"]) else values["bandwidth"]


def _find_starting_values(evidence: Evidence, channel: int) -> tuple[Values, ...]:
    """Find the bandwidth that fits a channel's measured response best in place of the model's, by search over a
    geometric grid of ten (chosen), refined by golden section; empty where none clearly improves the fit."""
    sample_rate_hz, model_bandwidth_hz = evidence.sample_rate_hz, evidence.model.sensor.bandwidth_hz
    bandwidth = find_response_parameter(
        evidence,
        channel,
        lambda samples, bandwidth_hz: apply_low_pass(
            undo_low_pass(samples, sample_rate_hz, model_bandwidth_hz), sample_rate_hz, bandwidth_hz
        ),
        list(np.geomspace(LOWEST_BANDWIDTH_SHARE * sample_rate_hz, HIGHEST_BANDWIDTH_SHARE * sample_rate_hz, 10)),
    )
    return () if bandwidth is None else ({"bandwidth": bandwidth},)


EFFECT = Effect(
    name="sensor_lag",
    equation="y' = 2 pi bandwidth (x - y), instead of the model's bandwidth",
    source="Analog Devices ADXL335 data sheet: bandwidth set by an RC filter of 32 kOhm +-15 %",
    signature="the response falls short and late at high frequencies, at every level alike, while the position agrees",
    parameters=(Parameter("bandwidth", 1e-2, 1e5, none=math.inf),),
    action=OnResponse(_keep_response, bandwidth_hz=_replace_bandwidth_hz),
    starts=_find_starting_values,
    sites=("all", "one"),
)
