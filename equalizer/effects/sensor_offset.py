"""Sensor offset (bias): a constant that is added to the reading, so that it is not zero at rest.

    y = x + offset        in the unit of the response

The measured position is not affected, in contrast to a constant force.
"""

import numpy as np

from equalizer.effects.effect import Effect, OnResponse, Parameter, Values
from equalizer.effects.starts.evidence import Evidence
from equalizer.signals.signal import FloatArray

LEAST_SIGMA = 4.0
"""Least offset that is tried, in standard errors of the mean residual (samples taken as independent)."""


def _add_offset(response: FloatArray, sample_rate_hz: float, channels: tuple[int, ...], values: Values) -> FloatArray:
    read = response.copy()
    read[:, channels] += values["offset"]
    return read


def _find_starting_values(evidence: Evidence, channel: int) -> tuple[Values, ...]:
    """The mean residual of the channel; empty where it is not significant."""
    residual = (evidence.response - evidence.predicted)[evidence.used > 0, channel]
    offset = float(residual.mean())
    large = abs(offset) * np.sqrt(len(residual)) > LEAST_SIGMA * float(residual.std())
    return ({"offset": offset},) if large else ()


EFFECT = Effect(
    name="sensor_offset",
    equation="y = x + offset",
    source="IEEE Std 1293, single-axis accelerometers: bias",
    signature="the response is off by the same amount all the time, at rest as in motion, while the position agrees",
    parameters=(Parameter("offset", -1e12, 1e12, none=0.0, scale="signed"),),
    action=OnResponse(_add_offset, stage=2),
    starts=_find_starting_values,
    sites=("one", "each"),
)
