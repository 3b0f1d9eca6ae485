"""Cubic sensor nonlinearity: the sensitivity changes with the reading, symmetrically."""

import numpy as np

from equalizer.effects.effect import Effect, OnResponse, Parameter, Values
from equalizer.effects.starts.evidence import Evidence
from equalizer.effects.starts.response_starts import channels_of, shares_of
from equalizer.signals.signal import FloatArray


def _add_cubic(response: FloatArray, sample_rate_hz: float, channels: tuple[int, ...], values: Values) -> FloatArray:
    read = response.copy()
    read[:, channels] += values["cubic"] * response[:, channels] ** 3
    return read


def _starts(evidence: Evidence, channel: int) -> tuple[Values, ...]:
    channels = list(channels_of(evidence, channel))
    weight = 1 / evidence.noise[channels]
    predicted = evidence.predicted[:, channels]
    residual = ((evidence.response[:, channels] - predicted) * weight).ravel()
    basis = np.column_stack([(predicted**3 * weight).ravel(), (predicted * weight).ravel()])
    # Re-tuned parameters can absorb what is proportional to the response itself.
    cubic = float(shares_of(residual, basis, np.repeat(evidence.used, len(channels)))[0])
    return ({"cubic": cubic},) if cubic != 0 and np.isfinite(cubic) else ()


EFFECT = Effect(
    name="sensor_nonlinearity",
    equation="y = x + cubic x^3",
    source="IEEE Std 1293, single-axis accelerometers: third-order coefficient of the model equation",
    signature="what the response is off by grows with its cube at every frequency, with odd harmonics that rise with "
    "the level, while the position agrees",
    parameters=(Parameter("cubic", -1e12, 1e12, none=0.0, scale="signed"),),
    acts=OnResponse(_add_cubic),
    starts=_starts,
    sites=("one", "all"),
)
