"""Functions that expressions of a map may call, such as `derivative(x)` and `clip(x, lowest, highest)`.

`FUNCTIONS` lists them with their usage and meaning; `expression` calls them, and `importing_docs` documents them.
Functions of time take the times of the samples from a `Clock`. Errors of numpy, for example for shapes that do not
match or fewer than two samples of a derivative, are passed on to `expression`.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

Value = npt.NDArray[np.float64]
"""Value of an expression: an array, or a number as an array of no dimensions."""


class Clock(Protocol):
    """Times of the samples that an expression works on."""

    def times_s(self, count: int) -> Value:
        """(count,): times of the samples (s). Raises ValueError where the times of so many samples are not defined."""
        ...


@dataclass(frozen=True, slots=True)
class Function:
    """A function that expressions may call, with its least and largest number of arguments, the clock not counted.
    usage and meaning: texts for the documentation."""

    usage: str
    meaning: str
    min_arguments: int
    max_arguments: int
    call: Callable[..., Any]
    """Arguments: the clock, then the values."""


def _make_time_independent(usage: str, meaning: str, function: Callable[..., Any], argument_count: int = 1) -> Function:
    """Make a function that does not depend on time and has a fixed number (`argument_count`) of arguments."""
    return Function(usage, meaning, argument_count, argument_count, lambda clock, *values: function(*values))


def _require_vector(values: Value) -> Value:
    """Return the array unchanged. Raises ValueError unless it has one dimension."""
    if np.ndim(values) != 1:
        raise ValueError(f"it needs an array of one dimension, not of shape {np.shape(values)}")
    return values


def _compute_differences(values: Value) -> Value:
    """Compute the difference of each sample (n,) from the previous one; the first is 0."""
    return np.diff(_require_vector(values), prepend=values[:1])


def _compute_derivative(clock: Clock, values: Value) -> Value:
    """Compute the derivative (n,), n >= 2, per second, by central differences; one-sided at the ends."""
    derivative: Value = np.gradient(_require_vector(values), clock.times_s(len(values)))
    return derivative


def _compute_integral(clock: Clock, values: Value) -> Value:
    """Compute the integral (n,), n >= 1, over time in s from the first sample, by the trapezoidal rule."""
    intervals_s = np.diff(clock.times_s(len(_require_vector(values))))
    return np.concatenate([[0.0], np.cumsum(intervals_s * (values[1:] + values[:-1]) / 2)])


def _find_onset(clock: Clock, values: Value, threshold: Value) -> int:
    """Find the index of the first sample whose difference from the mean of the first ten exceeds the threshold in
    magnitude. Raises ValueError without such a sample, also where one of the ten is NaN."""
    exceeds_threshold = np.abs(_require_vector(values) - np.mean(values[:10])) > float(threshold)
    if not exceeds_threshold.any():
        raise ValueError(f"nothing leaves the mean of the first ten samples by more than {float(threshold):g}")
    return int(np.argmax(exceeds_threshold))


def _repeat_in_sequence(values: Value, repetitions: Value) -> Value:
    """Repeat an array (n,) in sequence; `repetitions` is truncated to an integer."""
    return np.tile(_require_vector(values), int(repetitions))


FUNCTIONS: dict[str, Function] = {
    "abs": _make_time_independent("abs(x)", "magnitude", np.abs),
    "sqrt": _make_time_independent("sqrt(x)", "square root", np.sqrt),
    "exp": _make_time_independent("exp(x)", "exponential", np.exp),
    "log": _make_time_independent("log(x)", "natural logarithm", np.log),
    "sin": _make_time_independent("sin(x)", "sine, x in radians", np.sin),
    "cos": _make_time_independent("cos(x)", "cosine, x in radians", np.cos),
    "tan": _make_time_independent("tan(x)", "tangent, x in radians", np.tan),
    "sign": _make_time_independent("sign(x)", "sign: -1, 0 or 1", np.sign),
    "clip": _make_time_independent(
        "clip(x, lowest, highest)", "x limited to the range from lowest to highest", np.clip, 3
    ),
    "unwrap": _make_time_independent("unwrap(x)", "angle in radians without jumps by a full turn", np.unwrap),
    "mean": _make_time_independent("mean(x)", "a single number; missing samples are left out", np.nanmean),
    "median": _make_time_independent("median(x)", "likewise", np.nanmedian),
    "std": _make_time_independent("std(x)", "likewise", np.nanstd),
    "min": _make_time_independent("min(x)", "likewise", np.nanmin),
    "max": _make_time_independent("max(x)", "likewise", np.nanmax),
    "sum": _make_time_independent("sum(x)", "likewise", np.nansum),
    "length": _make_time_independent("length(x)", "number of samples", len),
    "diff": _make_time_independent(
        "diff(x)", "each sample minus the previous one; the first is 0", _compute_differences
    ),
    "cumsum": _make_time_independent("cumsum(x)", "running sum", lambda x: np.cumsum(_require_vector(x))),
    "derivative": Function("derivative(x)", "derivative per second, by central differences", 1, 1, _compute_derivative),
    "integral": Function(
        "integral(x)", "integral over seconds from 0, by the trapezoidal rule", 1, 1, _compute_integral
    ),
    "onset": Function(
        "onset(x, by)",
        "index of the first sample that differs from the mean of the first ten by more than `by`",
        2,
        2,
        _find_onset,
    ),
    "repeat": _make_time_independent("repeat(x, times)", "x repeated in sequence", _repeat_in_sequence, 2),
    "flatten": _make_time_independent("flatten(x)", "the rows of a table in sequence", np.ravel),
    "transpose": _make_time_independent("transpose(x)", "rows as columns", np.transpose),
}
"""Functions by name. `array("NAME")`, for names of arrays that are not identifiers, is evaluated in `expression`."""
