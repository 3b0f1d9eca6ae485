"""A sensor whose zero wanders away while it is recorded: warming up."""

import numpy as np

from equalizer.effects.effect import Effect, OnResponse, Parameter, Values
from equalizer.effects.evidence import Evidence
from equalizer.effects.response_starts import shares_of
from equalizer.signals.signal import FloatArray

LEAST_SIGMA = 5.0
STEEPEST = 3.0
"""Bend beyond which the zero would run back further than it came."""


def _shape(samples: int, bend: float) -> FloatArray:
    share = np.linspace(0.0, 1.0, samples)
    return np.asarray(share + 4 * bend * share * (1 - share))


def _drifted(response: FloatArray, sample_rate_hz: float, channels: tuple[int, ...], of: Values) -> FloatArray:
    read = response.copy()
    read[:, channels] += (of["total"] * _shape(len(response), of.get("bend", 0.0)))[:, None]
    return read


def _starts(evidence: Evidence, channel: int) -> tuple[Values, ...]:
    residual, n = (evidence.response - evidence.predicted)[:, channel], len(evidence.response)
    basis = np.column_stack([_shape(n, 0.0), _shape(n, 1.0) - _shape(n, 0.0)])
    total, middle = shares_of(residual, basis, evidence.used).tolist()
    straight = float(shares_of(residual, basis[:, :1], evidence.used)[0])
    size = float(np.sqrt(np.mean((residual - straight * basis[:, 0])[evidence.used > 0] ** 2)))
    if abs(straight) * np.sqrt(evidence.used.sum()) < LEAST_SIGMA * size:
        return ()
    bend = float(np.clip(middle / total, -STEEPEST, STEEPEST)) if total else 0.0
    return ({"total": total, "bend": bend}, {"total": straight, "bend": 0.0})


EFFECT = Effect(
    name="sensor_drift",
    equation="y = x + total (s + 4 bend s (1 - s)), s = t over the recording's length",
    source="Analog Devices ADXL335 data sheet: zero-g offset against temperature",
    signature="the response's zero moves slowly through the recording, the same at rest and in motion, while the "
    "position agrees",
    parameters=(
        Parameter("total", -1e12, 1e12, none=0.0, scale="signed"),
        Parameter("bend", -STEEPEST, STEEPEST, none=None, scale="linear", step=0.02),
    ),
    acts=OnResponse(_drifted, stage=2),
    starts=_starts,
    sites=("one", "each"),
)
