"""Functions that expressions of a map may call, such as `derivative(x)` and `clip(x, lowest, highest)`.

`FUNCTIONS` lists them with their usage and meaning. Functions of time take the times of the samples from a `Clock`.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

Value = npt.NDArray[np.float64]


class Clock(Protocol):
    """Times of the samples that an expression works on."""

    def times_s(self, count: int) -> Value:
        """(count,): times of the samples (s). Raises ValueError if this clock does not know them."""
        ...


@dataclass(frozen=True, slots=True)
class Function:
    """A function of expressions, with the fewest and the most arguments that it takes."""

    usage: str
    meaning: str
    fewest: int
    most: int
    call: Callable[..., Any]
    """Arguments: the clock, then the values."""


def _plain(usage: str, meaning: str, function: Callable[..., Any], count: int = 1) -> Function:
    """A function with a fixed number of arguments that does not depend on time."""
    return Function(usage, meaning, count, count, lambda clock, *values: function(*values))


def _line(values: Value) -> Value:
    """The array, if it has one dimension. Raises ValueError otherwise."""
    if np.ndim(values) != 1:
        raise ValueError(f"it needs an array of one dimension, not of shape {np.shape(values)}")
    return values


def _difference(values: Value) -> Value:
    """Differences of neighbouring samples (n,); the first is 0."""
    return np.diff(_line(values), prepend=values[:1])


def _derivative(clock: Clock, values: Value) -> Value:
    """Derivative (n,) per second, by central differences; one-sided at the ends."""
    found: Value = np.gradient(_line(values), clock.times_s(len(values)))
    return found


def _integral(clock: Clock, values: Value) -> Value:
    """Integral (n,) over seconds from the first sample, by the trapezoidal rule."""
    steps = np.diff(clock.times_s(len(_line(values))))
    return np.concatenate([[0.0], np.cumsum(steps * (values[1:] + values[:-1]) / 2)])


def _onset(clock: Clock, values: Value, threshold: Value) -> int:
    """Index of the first sample that differs from the mean of the first ten by more than the threshold. Raises
    ValueError without such a sample."""
    away = np.abs(_line(values) - np.mean(values[:10])) > float(threshold)
    if not away.any():
        raise ValueError(f"nothing leaves the mean of the first ten samples by more than {float(threshold):g}")
    return int(np.argmax(away))


def _repeat(values: Value, times: Value) -> Value:
    """The array, repeated `times` times."""
    return np.tile(_line(values), int(times))


FUNCTIONS: dict[str, Function] = {
    "abs": _plain("abs(x)", "magnitude", np.abs),
    "sqrt": _plain("sqrt(x)", "square root", np.sqrt),
    "exp": _plain("exp(x)", "exponential", np.exp),
    "log": _plain("log(x)", "natural logarithm", np.log),
    "sin": _plain("sin(x)", "x in radians", np.sin),
    "cos": _plain("cos(x)", "x in radians", np.cos),
    "tan": _plain("tan(x)", "x in radians", np.tan),
    "sign": _plain("sign(x)", "-1, 0 or 1", np.sign),
    "clip": _plain("clip(x, lowest, highest)", "held within two numbers", np.clip, 3),
    "unwrap": _plain("unwrap(x)", "an angle in radians without its jumps by a turn", np.unwrap),
    "mean": _plain("mean(x)", "one number; missing samples are left out", np.nanmean),
    "median": _plain("median(x)", "likewise", np.nanmedian),
    "std": _plain("std(x)", "likewise", np.nanstd),
    "min": _plain("min(x)", "likewise", np.nanmin),
    "max": _plain("max(x)", "likewise", np.nanmax),
    "sum": _plain("sum(x)", "likewise", np.nansum),
    "length": _plain("length(x)", "number of samples", len),
    "diff": _plain("diff(x)", "each sample less the one before; the first is 0", _difference),
    "cumsum": _plain("cumsum(x)", "running sum", lambda x: np.cumsum(_line(x))),
    "derivative": Function("derivative(x)", "per second, by central differences", 1, 1, _derivative),
    "integral": Function("integral(x)", "over seconds, from 0, by trapezoids", 1, 1, _integral),
    "onset": Function("onset(x, by)", "first sample that leaves the mean of the first ten by more", 2, 2, _onset),
    "repeat": _plain("repeat(x, times)", "one after another", _repeat, 2),
    "flatten": _plain("flatten(x)", "the rows of a table one after another", np.ravel),
    "transpose": _plain("transpose(x)", "rows as columns", np.transpose),
}
"""Functions by name. `array("NAME")`, for names that are not identifiers, is evaluated in `expression`."""
