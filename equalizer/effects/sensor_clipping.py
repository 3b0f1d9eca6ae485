"""Sensor clipping (saturation): readings are limited to the sensor's range.

    y = max(-limit, min(x, limit))        x: true signal, y: reading, limit: in the unit of the response

The mechanism is not affected: the response is clipped after the simulation. An entry of `equalizer.effects.catalogue`.
"""

import math

import numpy as np

from equalizer.effects.effect import Effect, OnResponse, Parameter, Values
from equalizer.effects.starts.evidence import Evidence
from equalizer.effects.starts.response_starts import find_response_parameter, list_site_channels
from equalizer.signals.signal import FloatArray


def _clip_response(
    response: FloatArray, sample_rate_hz: float, channels: tuple[int, ...], values: Values
) -> FloatArray:
    """Clip these channels of the response (n, p) at +-limit: `OnResponse.change` of this effect."""
    readings = response.copy()
    readings[:, channels] = np.clip(response[:, channels], -values["limit"], values["limit"])
    return readings


def _find_starting_values(evidence: Evidence, channel: int) -> tuple[Values, ...]:
    """Find the limit, from 5 % to 99 % of the predicted peak, that brings the predicted response closest to the
    measured one; empty where no limit is clearly better than none."""
    peak = float(np.abs(evidence.predicted[:, list(list_site_channels(evidence, channel))]).max())
    if peak == 0:
        return ()
    limit = find_response_parameter(
        evidence,
        channel,
        lambda samples, value: np.clip(samples, -value, value),
        list(np.geomspace(0.05 * peak, 0.99 * peak, 12)),
    )
    return () if limit is None else ({"limit": limit},)


EFFECT = Effect(
    name="sensor_clipping",
    equation="y = max(-limit, min(x, limit))",
    source="Analog Devices ADXL335 data sheet: measurement range",
    signature="the peaks of the response are cut off flat at one height, at the top level alone, while the position "
    "agrees",
    parameters=(Parameter("limit", 1e-9, 1e9, none=math.inf),),
    action=OnResponse(_clip_response, stage=1),
    starts=_find_starting_values,
    sites=("one", "all"),
)
