"""Cubic sensor nonlinearity: the sensitivity changes with the square of the response, in both directions alike.

    y = x + cubic x³        cubic in 1 / (unit of the response)²

The reading has odd harmonics that grow with the level; the measured position is not affected. An entry of
`equalizer.effects.catalogue`.
"""

import numpy as np

from equalizer.effects.effect import Effect, OnResponse, Parameter, Values
from equalizer.effects.starts.evidence import Evidence
from equalizer.effects.starts.response_starts import fit_coefficients, list_site_channels
from equalizer.signals.signal import FloatArray


def _add_cubic(response: FloatArray, sample_rate_hz: float, channels: tuple[int, ...], values: Values) -> FloatArray:
    """Add the cubic term to these channels of the response (n, p): `OnResponse.change` of this effect."""
    readings = response.copy()
    readings[:, channels] += values["cubic"] * response[:, channels] ** 3
    return readings


def _find_starting_values(evidence: Evidence, channel: int) -> tuple[Values, ...]:
    """Find the cubic coefficient by linear regression of the residual, weighted by the noise; empty where it is 0 or
    not finite."""
    channels = list(list_site_channels(evidence, channel))
    weight = 1 / evidence.noise[channels]
    predicted = evidence.predicted[:, channels]
    residual = ((evidence.response[:, channels] - predicted) * weight).ravel()
    basis = np.column_stack([(predicted**3 * weight).ravel(), (predicted * weight).ravel()])
    # The response itself is a second regressor, because re-tuned parameters can absorb a change of gain.
    cubic = float(fit_coefficients(residual, basis, np.repeat(evidence.used, len(channels)))[0])
    return ({"cubic": cubic},) if cubic != 0 and np.isfinite(cubic) else ()


EFFECT = Effect(
    name="sensor_nonlinearity",
    equation="y = x + cubic x^3",
    source="IEEE Std 1293, single-axis accelerometers: third-order coefficient of the model equation",
    signature="the error of the response grows with the cube of the response at every frequency, with odd harmonics "
    "that rise with the level, while the position agrees",
    parameters=(Parameter("cubic", -1e12, 1e12, none=0.0, scale="signed"),),
    action=OnResponse(_add_cubic),
    starts=_find_starting_values,
    sites=("one", "all"),
)
