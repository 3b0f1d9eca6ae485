"""Sensor gain: a sensitivity that differs from the one in the data sheet by a constant factor.

    y = gain x        x: true response, y: reading, both in the unit of the response

The measured position is not affected, in contrast to a gain error of the actuator. An entry of
`equalizer.effects.catalogue`.
"""

import numpy as np

from equalizer.effects.effect import Effect, OnResponse, Parameter, Values
from equalizer.effects.starts.evidence import Evidence
from equalizer.effects.starts.response_starts import list_site_channels
from equalizer.signals.signal import FloatArray

LEAST_DEVIATION = 1e-4
"""Deviation of a gain from 1 that must be exceeded for it to be tried. Chosen."""


def _scale_response(
    response: FloatArray, sample_rate_hz: float, channels: tuple[int, ...], values: Values
) -> FloatArray:
    """Scale these channels of the response (n, p): `OnResponse.change` of this effect."""
    readings = response.copy()
    readings[:, channels] *= values["gain"]
    return readings


def _find_starting_values(evidence: Evidence, channel: int) -> tuple[Values, ...]:
    """Find the gain by least squares of the measured on the predicted response; empty where it is 1 within
    `LEAST_DEVIATION` or not positive."""
    channels, used = list(list_site_channels(evidence, channel)), evidence.used > 0
    measured = (evidence.response[:, channels] / evidence.noise[channels])[used]
    predicted = (evidence.predicted[:, channels] / evidence.noise[channels])[used]
    predicted_power = float(np.sum(predicted**2))
    gain = float(np.sum(measured * predicted)) / predicted_power if predicted_power > 0 else 1.0
    return ({"gain": gain},) if gain > 0 and abs(gain - 1) > LEAST_DEVIATION else ()


EFFECT = Effect(
    name="sensor_gain",
    equation="y = gain x",
    source="Analog Devices ADXL335 data sheet: sensitivity 270 to 330 mV/g, in proportion to the supply",
    signature="the response is wrong by one factor at every frequency and level, while the position agrees",
    parameters=(Parameter("gain", 0.01, 100.0, none=1.0),),
    action=OnResponse(_scale_response),
    starts=_find_starting_values,
    sites=("one", "all"),
)
