"""Sensor drift: the zero offset of a sensor moves slowly during a recording, for example while the sensor warms up.

The drift is a parabola over the recording's length, added to the response x:

    y = x + total (start + s + 4 bend s (1 - s)),    s from 0 at the first sample to 1 at the last.

`total` is the change of the offset from beginning to end, in the response's unit; `bend` the deviation from a straight
line in the middle, and `start` the offset at the beginning, both relative to `total`.
"""

import numpy as np

from equalizer.effects.effect import Effect, OnResponse, Parameter, Values
from equalizer.effects.starts.evidence import Evidence
from equalizer.effects.starts.response_starts import regression_coefficients
from equalizer.signals.signal import FloatArray

LEAST_SIGMA = 5.0
"""Least linear drift, in its standard errors, for the effect to be tried."""
STEEPEST = 3.0
"""Bounds of the magnitudes of `bend` and `start`, relative to the total drift."""


def _drift_shape(samples: int, bend: float, start: float = 0.0) -> FloatArray:
    """(samples,): the drift relative to its total."""
    share = np.linspace(0.0, 1.0, samples)
    return np.asarray(start + share + 4 * bend * share * (1 - share))


def _add_drift(response: FloatArray, sample_rate_hz: float, channels: tuple[int, ...], values: Values) -> FloatArray:
    """(n, p): the response with the drift added to these channels."""
    read = response.copy()
    shape = _drift_shape(len(response), values.get("bend", 0.0), values.get("start", 0.0))
    read[:, channels] += (values["total"] * shape)[:, None]
    return read


def _starts(evidence: Evidence, channel: int) -> tuple[Values, ...]:
    """Starting values from the residual by linear least squares: with and without a quadratic term; none where the
    linear drift is not significant."""
    residual, n = (evidence.response - evidence.predicted)[:, channel], len(evidence.response)
    basis = np.column_stack([_drift_shape(n, 0.0), _drift_shape(n, 1.0) - _drift_shape(n, 0.0), np.ones(n)])
    total, middle, first = regression_coefficients(residual, basis, evidence.used).tolist()
    slope, zero = regression_coefficients(residual, basis[:, [0, 2]], evidence.used).tolist()
    size = float(np.sqrt(np.mean((residual - slope * basis[:, 0] - zero)[evidence.used > 0] ** 2)))
    # With white residuals, the standard error of a slope that is fitted together with an offset, over s from 0 to 1, is
    # sqrt(12 / n) times the residual's rms: the variance of s is 1/12.
    if abs(slope) * np.sqrt(evidence.used.sum() / 12) < LEAST_SIGMA * size:
        return ()
    return (
        {"total": total, "bend": _share(middle, total), "start": _share(first, total)},
        {"total": slope, "bend": 0.0, "start": _share(zero, slope)},
    )


def _share(part: float, total: float) -> float:
    """A part relative to the total, within the bounds; 0 where the total is 0."""
    return float(np.clip(part / total, -STEEPEST, STEEPEST)) if total else 0.0


EFFECT = Effect(
    name="sensor_drift",
    equation="y = x + total (start + s + 4 bend s (1 - s)), s = t over the recording's length",
    source="Analog Devices ADXL335 data sheet: zero-g offset against temperature",
    signature="the response's zero moves slowly through the recording, the same at rest and in motion, while the "
    "position agrees",
    parameters=(
        Parameter("total", -1e12, 1e12, none=0.0, scale="signed"),
        Parameter("bend", -STEEPEST, STEEPEST, none=None, scale="linear", step=0.02),
        Parameter("start", -STEEPEST, STEEPEST, none=None, scale="linear", step=0.02),
    ),
    action=OnResponse(_add_drift, stage=2, needs_full_length=True),
    starts=_starts,
    of_time=True,
    sites=("one", "each"),
)
