"""Time base of a logger's channels: a stated rate, or time stamps, which are checked and brought to a uniform grid.

Stamps are refused where they are missing, run backwards (a counter that wraps around, a clock that is set back),
repeat, jump ahead once by an hour while other steps are short, or span too many samples (`MAX_SAMPLES`); the message
names a sample and, where there is one, the remedy. Stamps that are uniform apart from rounding and skipped rows give a
rate and the index of each sample (`uniform_stamps`). `drop_doubled_rows` removes rows that a logger wrote twice.
"""

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from equalizer.signals.resampling import Samples
from equalizer.signals.units import UnknownUnitError, parse_unit
from study.importing.arrays.read_arrays import Array
from study.importing.expressions.expression import quote_name
from study.importing.expressions.functions import Value
from study.importing.expressions.namespace import Namespace, NoTime
from study.importing.map_format.import_map import ClockMap
from study.importing.map_format.map_errors import ImportProblemError
from study.importing.uniform_stamps import GRID_TOLERANCE, IntArray, find_decimal_unit, fit_uniform_rate

_GAP_STEPS = 3
"""A step longer than this many median steps is a gap, unless the map states `gap_s`. Chosen."""
_GAP_PERIODS = 1.5
"""With a rate or a uniform grid, a step longer than this many periods is a gap, so that one skipped row (a step of two
periods) is one, unless the map states `gap_s`. Chosen: halfway between one and two periods."""
_HOUR_S = 3600.0
"""Step (s) of a clock that is set to summer time or back."""
_COUNTER_LIMITS = (2**16, 2**24, 2**31, 2**32, 10**6, 10**9)
"""Values at which counters of loggers wrap around to 0, in the unit of the file: binary counters, and decimal ones
such as the microseconds or nanoseconds of a second."""
PLACEHOLDER_RATE_HZ = 1.0
"""Placeholder rate (Hz) of samples whose time is unknown."""
MAX_SAMPLES = 10**8
"""Largest number of samples of a part of a recording (28 hours at 1 kHz). A wrong stamp would otherwise fill the memory
with missing samples. Chosen."""


@dataclass(frozen=True, slots=True, eq=False)
class TimeBase:
    """Time base of one clock in one part of a recording (one file, or one run in it)."""

    name: str
    """Name of the clock in the map."""
    rate_hz: float
    """Sample rate (Hz); 0 if stamps are not uniform."""
    stamps_s: Value | None
    """(n,) as logged, in seconds; None for a clock without stamps."""
    sample_index: IntArray | None
    """(n,): index of each stamp's sample at the uniform rate; None if stamps are not uniform, or there are none."""
    gap_s: float
    """A step of the stamps longer than this is a gap, in which samples are missing (s)."""
    offset_s: float = 0.0
    """Offset that is added to give the time of the reference clock (s)."""

    @property
    def typical_rate_hz(self) -> float:
        """The sample rate (Hz); for stamps that are not uniform, the rate of their median step."""
        return self.rate_hz or 1 / float(np.median(np.diff(self.times_s(0))))

    def times_s(self, count: int) -> Value:
        """Compute the times (count,) by the clock of the logger (s); the method is one of
        `expressions.functions.Clock`. With stamps, `count` is ignored: there are as many times as stamps."""
        if self.stamps_s is None:
            return np.arange(count) / self.rate_hz
        if self.sample_index is not None:
            uniform_s: Value = self.stamps_s[0] + self.sample_index / self.rate_hz
            return uniform_s
        return self.stamps_s

    def describe_gaps(self) -> str:
        """Describe the number of gaps in the stamps, and the key that declares that nothing is missing; empty without
        gaps."""
        steps_s = np.diff(self.times_s(0)) if self.stamps_s is not None else np.zeros(0)
        gaps_s = steps_s[steps_s > self.gap_s]
        if not len(gaps_s):
            return ""
        gaps_text = f"{len(gaps_s)} gap{'s' if len(gaps_s) > 1 else ''}"
        return (
            f"Clock '{self.name}' has {gaps_text} (the widest {gaps_s.max():.4g} s): their samples are missing. Where "
            f"nothing is missing, as in a log of changes, write gap_s = {1.01 * gaps_s.max():.3g} and its `time` under "
            "[[clock]] in the map, and resample under each [[channel]]."
        )

    def describe_wander(self) -> str:
        """Describe the deviation of the stamps from the uniform grid that was fitted, in a sentence; empty where it is
        within `GRID_TOLERANCE` (in periods), or no grid was fitted."""
        if self.stamps_s is None or self.sample_index is None:
            return ""
        deviation_s = float(np.max(np.abs(self.times_s(0) - self.stamps_s)))
        if deviation_s * self.rate_hz <= GRID_TOLERANCE:
            return ""
        return (
            f"Clock '{self.name}': its stamps are uniform apart from the rounding of their last decimal, so "
            f"{self.rate_hz:.6g} Hz is taken; they lie up to {deviation_s:.2g} s from a uniform grid."
        )

    def make_samples(self, values: Value) -> Samples:
        """Make samples from the values (n,) and their times by the reference clock. Rows that a uniform logger skipped
        become NaN, unless the map says that there are no gaps."""
        times_s = self.times_s(len(values)) + self.offset_s
        longest_step_s = 0.0 if self.sample_index is None else float(np.max(np.diff(self.sample_index))) / self.rate_hz
        if (
            self.sample_index is not None
            and self.sample_index[-1] > len(self.sample_index) - 1
            and longest_step_s <= self.gap_s
        ):
            return Samples(times_s, values, 0.0, self.gap_s)  # the map declares that nothing is missing between them
        if self.sample_index is None or self.sample_index[-1] == len(self.sample_index) - 1:
            return Samples(times_s, values, self.rate_hz, self.gap_s)
        padded_values = np.full(self.sample_index[-1] + 1, np.nan)
        padded_values[self.sample_index] = values
        return Samples(
            times_s[0] + np.arange(len(padded_values)) / self.rate_hz, padded_values, self.rate_hz, self.gap_s
        )


def make_time_base(clock: ClockMap, namespace: Namespace) -> TimeBase:
    """Make the time base of a clock of the map, without its offset to other clocks. namespace: the arrays of the file.
    Raises ImportProblemError where the rate cannot be computed or is not positive, or the stamps are unusable."""
    if clock.time:
        return _make_base_from_stamps(clock, namespace)
    rate_hz = PLACEHOLDER_RATE_HZ if clock.unknown else clock.rate_hz or namespace.compute_number(clock.rate)
    if not rate_hz > 0:
        raise ImportProblemError(f"clock '{clock.name}': its rate, {clock.rate}, is {rate_hz:g}; it must be above 0")
    return TimeBase(clock.name, rate_hz, None, None, clock.gap_s or _GAP_PERIODS / rate_hz)


def _make_base_from_stamps(clock: ClockMap, namespace: Namespace) -> TimeBase:
    """Make the time base from time stamps. Raises ImportProblemError where their unit, expression, shape, values or
    number of samples are unusable."""
    try:
        unit = parse_unit(clock.time_unit)
    except UnknownUnitError as error:
        raise ImportProblemError(f"clock '{clock.name}': time_unit: {error}") from error
    if unit.si != "s":
        raise ImportProblemError(f"clock '{clock.name}': time_unit is '{clock.time_unit}', which is no unit of time")
    stamps_s: Value = namespace.compute_value(clock.time, NoTime()) * unit.factor
    if stamps_s.ndim != 1 or len(stamps_s) < 2:
        raise ImportProblemError(
            f"clock '{clock.name}': {clock.time} has the shape {stamps_s.shape}; stamps are one row of two or more"
        )
    if problem := _find_stamp_problem(stamps_s, _format_stamps_expression(clock.time, namespace), unit.factor):
        raise ImportProblemError(f"clock '{clock.name}': {clock.time} {problem}")
    rate_hz, sample_index = fit_uniform_rate(stamps_s, find_decimal_unit(stamps_s / unit.factor) * unit.factor)
    if sample_index is not None and sample_index[-1] >= MAX_SAMPLES:
        jump_row = int(np.argmax(np.diff(stamps_s)))
        raise ImportProblemError(
            f"clock '{clock.name}': {clock.time} jumps from {stamps_s[jump_row]:.9g} to {stamps_s[jump_row + 1]:.9g} s "
            f"at sample {jump_row + 1}; at {rate_hz:g} Hz the recording would be {sample_index[-1] + 1:.3g} "
            "samples long, most of them missing. Correct the stamps, or cut the file there into several, which are "
            "imported together"
        )
    gap_s = clock.gap_s or _GAP_STEPS * float(np.median(np.diff(stamps_s)))
    if sample_index is not None and not clock.gap_s:
        gap_s = min(gap_s, _GAP_PERIODS / rate_hz)
    return TimeBase(clock.name, rate_hz, stamps_s, sample_index, gap_s)


def _format_stamps_expression(array_name: str, namespace: Namespace) -> str:
    """Format the stamps as an expression that a map can contain: the name of an array that is no identifier is written
    as array('…')."""
    return quote_name(array_name) if array_name in namespace.arrays else array_name


def _find_stamp_problem(stamps_s: Value, time_expression: str, unit_s: float) -> str:
    """Find the problem with the stamps (n,) and its remedy, if there is one, as a clause after the name of the stamps;
    empty if they are finite and increase without a single jump of an hour. time_expression: expression of the stamps;
    unit_s: their unit (s). Tolerances (chosen): two median steps for the limit of a counter, a minute for an hour back,
    ten median steps for an hour ahead, which is looked for only in stamps with median steps below 3.6 s."""
    if not np.isfinite(stamps_s).all():
        return f"is no number at sample {int(np.argmax(~np.isfinite(stamps_s)))}; time is never missing"
    steps_s = np.diff(stamps_s)
    if (steps_s < 0).any():
        row = int(np.argmax(steps_s < 0)) + 1
        backward_s = float(-steps_s[row - 1])
        problem = f"runs backwards at sample {row}, from {stamps_s[row - 1]:.9g} to {stamps_s[row]:.9g} s"
        median_s = float(np.median(steps_s))
        limit = next(
            (limit for limit in _COUNTER_LIMITS if abs(backward_s + median_s - limit * unit_s) < 2 * median_s), 0
        )
        if limit and stamps_s.max() < limit * unit_s and stamps_s.min() >= 0:
            return (
                f"{problem}, as a counter that restarts at {limit}; the map's [[clock]] mends it: "
                f'time = "{time_expression} + {limit} * cumsum(diff({time_expression}) < 0)"'
            )
        if abs(backward_s - _HOUR_S) > _HOUR_S / 60:
            return f"{problem}; put the rows in order, or cut the file there into several, which are imported together"
        remedy = f"{time_expression} + {_HOUR_S / unit_s:g} * cumsum(diff({time_expression}) < 0)"
        return f'{problem}, as a clock that is set back by an hour; the map\'s [[clock]] mends it: time = "{remedy}"'
    if (steps_s == 0).any():
        row = int(np.argmax(steps_s == 0)) + 1
        rate_hz = (len(stamps_s) - 1) / float(np.ptp(stamps_s)) if np.ptp(stamps_s) else 1000.0
        return (
            f"stands still at sample {row}, at {stamps_s[row]:.9g} s; where the sampling was even and only the "
            f"stamps are coarse, state the rate in place of `time` in the map's [[clock]], as in "
            f"rate_hz = {rate_hz:.4g}; where a sample was logged twice with other values, remove either of the two"
        )
    hour_steps = np.flatnonzero(np.abs(steps_s - _HOUR_S) < 10 * float(np.median(steps_s)))
    if len(hour_steps) == 1 and float(np.median(steps_s)) < _HOUR_S / 1000:
        jump_condition_text = f"diff({time_expression}) > {steps_s[hour_steps[0]] / 2 / unit_s:.4g}"
        remedy = f"{time_expression} - {_HOUR_S / unit_s:g} * cumsum({jump_condition_text})"
        return (
            f"jumps ahead by an hour at sample {hour_steps[0] + 1}, as a clock that is set to summer time; the map's "
            f'[[clock]] mends it: time = "{remedy}"'
        )
    return ""


def drop_doubled_rows(clock: ClockMap, namespace: Namespace) -> tuple[Namespace, str]:
    """Remove rows that repeat the row above, with the same stamp. Returns the arrays without them, and a sentence with
    their number, empty where nothing is removed: without two or more stamps, without repeated ones, or if any row with
    a repeated stamp has other values (row counters aside) than the row above. Raises ImportProblemError where the
    expression of the stamps cannot be computed."""
    if not clock.time:
        return namespace, ""
    stamps: Value = namespace.compute_value(clock.time, NoTime())
    if stamps.ndim != 1 or len(stamps) < 2:
        return namespace, ""
    repeated_rows = np.flatnonzero(stamps[1:] == stamps[:-1]) + 1
    row_arrays = [
        array for array in namespace.arrays.values() if _has_row_count(array, len(stamps)) and not _is_counter(array)
    ]
    if not len(repeated_rows) or not all(_is_repeated(array, repeated_rows) for array in row_arrays):
        return namespace, ""
    kept_rows = np.delete(np.arange(len(stamps)), repeated_rows)
    kept_arrays = {
        name: array[kept_rows] if _has_row_count(array, len(stamps)) else array
        for name, array in namespace.arrays.items()
    }
    rows_text = f"{len(repeated_rows)} row{'s' if len(repeated_rows) > 1 else ''}"
    remark = f"Clock '{clock.name}': {rows_text} logged twice (the same stamp, the same values) left out."
    return replace(namespace, arrays=kept_arrays), remark


def _is_repeated(array: Array, rows: npt.NDArray[np.intp]) -> bool:
    """Whether each of these rows of an array equals the row above it."""
    return np.array_equal(array[rows], array[rows - 1], equal_nan=array.dtype.kind == "f")


@np.errstate(all="ignore")
def _is_counter(array: Array) -> bool:
    """Whether an array is a row counter, which grows even where a row was logged twice."""
    return array.ndim == 1 and array.dtype.kind in "fiu" and bool((array[1:] - array[:-1] == 1).all())


def _has_row_count(array: Array, count: int) -> bool:
    """Whether an array has an entry for each of `count` rows."""
    return array.ndim >= 1 and len(array) == count
