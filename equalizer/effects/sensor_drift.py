"""Sensor drift: the zero offset of a sensor moves slowly during a recording, for example while the sensor warms up.

The drift is a parabola over the recording's length, added to the response x:

    y = x + total (start + s + 4 bend s (1 - s)),    s from 0 at the first sample to 1 at the last.

`total` is the change of the offset from beginning to end, in the response's unit; `bend` the deviation from a straight
line in the middle, and `start` the offset at the beginning, both relative to `total`. An entry of
`equalizer.effects.catalogue`.
"""

import numpy as np

from equalizer.effects.effect import Effect, OnResponse, Parameter, Values
from equalizer.effects.starts.evidence import Evidence
from equalizer.effects.starts.response_starts import fit_coefficients
from equalizer.signals.signal import FloatArray

LEAST_OFFSET_CHANGE_SIGMA = 5.0
"""Least total of a linear drift, in its standard errors, for the effect to be tried. Chosen."""
LARGEST_RATIO = 3.0
"""Largest magnitude of `bend` and `start`, which are relative to the total drift. Chosen."""


def _compute_drift_shape(sample_count: int, bend: float, start: float = 0.0) -> FloatArray:
    """Compute the drift (sample_count,) relative to its total, by the equation of the module."""
    time_share = np.linspace(0.0, 1.0, sample_count)
    return np.asarray(start + time_share + 4 * bend * time_share * (1 - time_share))


def _add_drift(response: FloatArray, sample_rate_hz: float, channels: tuple[int, ...], values: Values) -> FloatArray:
    """Add the drift to these channels of the response (n, p): `OnResponse.change` of this effect."""
    drifted_response = response.copy()
    shape = _compute_drift_shape(len(response), values.get("bend", 0.0), values.get("start", 0.0))
    drifted_response[:, channels] += (values["total"] * shape)[:, None]
    return drifted_response


def _find_starting_values(evidence: Evidence, channel: int) -> tuple[Values, ...]:
    """Find starting values from the residual by linear least squares: with a quadratic term, then without; none where
    the linear drift is not significant."""
    residual, sample_count = (evidence.response - evidence.predicted)[:, channel], len(evidence.response)
    basis = np.column_stack(
        [
            _compute_drift_shape(sample_count, 0.0),
            _compute_drift_shape(sample_count, 1.0) - _compute_drift_shape(sample_count, 0.0),
            np.ones(sample_count),
        ]
    )
    total, bend_coefficient, offset = fit_coefficients(residual, basis, evidence.used).tolist()
    linear_total, linear_offset = fit_coefficients(residual, basis[:, [0, 2]], evidence.used).tolist()
    residual_rms = float(
        np.sqrt(np.mean((residual - linear_total * basis[:, 0] - linear_offset)[evidence.used > 0] ** 2))
    )
    # With white residuals, the standard error of a slope that is fitted together with an offset, over s from 0 to 1, is
    # sqrt(12 / n) times the residual's rms: the variance of s is 1/12.
    if abs(linear_total) * np.sqrt(evidence.used.sum() / 12) < LEAST_OFFSET_CHANGE_SIGMA * residual_rms:
        return ()
    return (
        {"total": total, "bend": _limit_ratio(bend_coefficient, total), "start": _limit_ratio(offset, total)},
        {"total": linear_total, "bend": 0.0, "start": _limit_ratio(linear_offset, linear_total)},
    )


def _limit_ratio(coefficient: float, total: float) -> float:
    """Compute a coefficient relative to the total, limited to `LARGEST_RATIO`; 0 where the total is 0."""
    return float(np.clip(coefficient / total, -LARGEST_RATIO, LARGEST_RATIO)) if total else 0.0


EFFECT = Effect(
    name="sensor_drift",
    equation="y = x + total (start + s + 4 bend s (1 - s)), s = t over the recording's length",
    source="Analog Devices ADXL335 data sheet: zero-g offset against temperature",
    signature="the response's zero moves slowly through the recording, the same at rest and in motion, while the "
    "position agrees",
    parameters=(
        Parameter("total", -1e12, 1e12, none=0.0, scale="signed"),
        Parameter("bend", -LARGEST_RATIO, LARGEST_RATIO, none=None, scale="linear", step=0.02),
        Parameter("start", -LARGEST_RATIO, LARGEST_RATIO, none=None, scale="linear", step=0.02),
    ),
    action=OnResponse(_add_drift, stage=2, needs_full_length=True),
    starts=_find_starting_values,
    of_time=True,
    sites=("one", "each"),
)
