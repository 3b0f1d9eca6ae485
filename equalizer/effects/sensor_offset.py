"""Sensor offset (bias): a constant that is added to the reading, so that it is not zero at rest.

    y = x + offset        in the unit of the response

The separately measured position is not affected, in contrast to a constant force. `equalizer.effects.catalogue` lists
the effect.
"""

import numpy as np

from equalizer.effects.effect import Effect, OnResponse, Parameter, Values
from equalizer.effects.starts.evidence import Evidence
from equalizer.signals.signal import FloatArray

SIGNIFICANCE_THRESHOLD = 4.0
"""Least magnitude of a starting offset, in standard errors of the mean residual with samples taken as independent.
Chosen: well above chance, because samples are correlated."""


def _add_offset(response: FloatArray, sample_rate_hz: float, channels: tuple[int, ...], values: Values) -> FloatArray:
    """Add the offset to the channels of a copy of the response (n, p)."""
    offset_response = response.copy()
    offset_response[:, channels] += values["offset"]
    return offset_response


def _find_starting_values(evidence: Evidence, channel: int) -> tuple[Values, ...]:
    """Estimate the offset as the mean residual of the channel; empty where its magnitude is at most
    `SIGNIFICANCE_THRESHOLD` standard errors, or without usable samples (NumPy then warns)."""
    residual = (evidence.response - evidence.predicted)[evidence.used > 0, channel]
    offset = float(residual.mean())
    is_significant = abs(offset) * np.sqrt(len(residual)) > SIGNIFICANCE_THRESHOLD * float(residual.std())
    return ({"offset": offset},) if is_significant else ()


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
