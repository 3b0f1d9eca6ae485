"""Time base of a logger: from a rate, or from time stamps, which are checked first; rows that were logged twice."""

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from equalizer.signals.resampling import Samples
from equalizer.signals.units import UnknownUnitError, parse_unit
from study.importing.arrays.arrays import Array
from study.importing.expressions.functions import Value
from study.importing.expressions.namespace import Namespace, NoTime
from study.importing.map_format.import_map import ClockMap
from study.importing.map_format.map_errors import ImportProblemError

IntArray = npt.NDArray[np.int64]

UNEVEN = 0.02
"""Tolerance for uniform stamps: largest deviation from the grid, as a fraction of a step."""
LEFT_OUT = 0.02
"""A uniform logger skips at most this fraction of its rows; more indicates rounded stamps."""
_MOST_DECIMALS = 6
"""Most decimals of a time stamp that are looked for: down to a microsecond where stamps are in seconds."""
_BINARY = 1e-3
"""Tolerance of a decimal: deviation of a binary number that is the difference of large ones."""
_USUAL_GAP = 3
"""Steps, in median steps, from which stamps have a gap."""
_HOUR_S = 3600.0
"""Step of a clock that is set to summer time or back (s)."""
_COUNTERS = (2**16, 2**24, 2**31, 2**32, 10**6, 10**9)
"""Values at which the clocks of loggers wrap around, in units of the file."""
_PLAIN_DIGITS = (4, 5, 6)
"""Significant digits to which a rate is rounded before it is tried as the exact one."""
NUMBERED_HZ = 1.0
"""Nominal rate of samples without known time."""
MOST_SAMPLES = 10**8
"""Longest recording: a day at 1 kHz. A wrong stamp would otherwise fill the memory with missing samples."""


@dataclass(frozen=True, slots=True, eq=False)
class TimeBase:
    """Time base of one clock in one part."""

    name: str
    rate_hz: float
    """Sample rate; 0 if stamps are not uniform."""
    stamps_s: Value | None
    """(n,) as logged; None for a clock with a rate only."""
    places: IntArray | None
    """(n,): sample indices of the stamps at the uniform rate; None if not uniform."""
    gap_s: float
    offset_s: float = 0.0
    """Offset that is added to give the reference clock's time."""

    @property
    def fastest_hz(self) -> float:
        """The stated rate, else that of the median step of the stamps (Hz)."""
        return self.rate_hz or 1 / float(np.median(np.diff(self.times_s(0))))

    def times_s(self, count: int) -> Value:
        """(count,) times by the logger's own clock; with stamps, as many as there are."""
        if self.stamps_s is None:
            return np.arange(count) / self.rate_hz
        if self.places is not None:
            evened: Value = self.stamps_s[0] + self.places / self.rate_hz
            return evened
        return self.stamps_s

    def gaps(self) -> str:
        """Number of gaps in the stamps, and the key that declares otherwise; empty without gaps."""
        steps_s = np.diff(self.times_s(0)) if self.stamps_s is not None else np.zeros(0)
        wide_s = steps_s[steps_s > self.gap_s]
        if not len(wide_s):
            return ""
        count = f"{len(wide_s)} gap{'s' if len(wide_s) > 1 else ''}"
        return (
            f"Clock '{self.name}' has {count} (the widest {wide_s.max():.4g} s): their samples are missing. Where "
            f"nothing is, as in a log of changes, write gap_s = {1.01 * wide_s.max():.3g} and its `time` under "
            "[[clock]] in the map, and resample under each [[channel]]."
        )

    def wander(self) -> str:
        """Deviation of stamps from the uniform grid that was fitted to them; empty where negligible."""
        if self.stamps_s is None or self.places is None:
            return ""
        off_s = float(np.max(np.abs(self.times_s(0) - self.stamps_s)))
        if off_s * self.rate_hz <= UNEVEN:
            return ""
        return (
            f"Clock '{self.name}': its stamps are even but for their last decimal, so {self.rate_hz:.6g} Hz is taken; "
            f"they lie up to {off_s:.2g} s from an even grid."
        )

    def samples(self, values: Value) -> Samples:
        """Sample times by the reference clock. Rows skipped by a uniform logger are missing samples, unless the map
        says that there are no gaps."""
        times_s = self.times_s(len(values)) + self.offset_s
        widest_s = 0.0 if self.places is None else float(np.max(np.diff(self.places))) / self.rate_hz
        if self.places is not None and self.places[-1] > len(self.places) - 1 and widest_s <= self.gap_s:
            return Samples(times_s, values, 0.0, self.gap_s)  # the map declares that nothing is missing between them
        if self.places is None or self.places[-1] == len(self.places) - 1:
            return Samples(times_s, values, self.rate_hz, self.gap_s)
        every = np.full(self.places[-1] + 1, np.nan)
        every[self.places] = values
        return Samples(times_s[0] + np.arange(len(every)) / self.rate_hz, every, self.rate_hz, self.gap_s)


def time_base(clock: ClockMap, names: Namespace) -> TimeBase:
    """Time base without the offset to other clocks. Raises ImportProblemError."""
    if clock.time:
        return _base_from_stamps(clock, names)
    rate_hz = NUMBERED_HZ if clock.unknown else clock.rate_hz or names.number(clock.rate)
    if not rate_hz > 0:
        raise ImportProblemError(f"clock '{clock.name}': its rate, {clock.rate}, is {rate_hz:g}; it must be above 0")
    return TimeBase(clock.name, rate_hz, None, None, clock.gap_s or 1.5 / rate_hz)


def _base_from_stamps(clock: ClockMap, names: Namespace) -> TimeBase:
    try:
        unit = parse_unit(clock.time_unit)
    except UnknownUnitError as error:
        raise ImportProblemError(f"clock '{clock.name}': time_unit: {error}") from error
    if unit.si != "s":
        raise ImportProblemError(f"clock '{clock.name}': time_unit is '{clock.time_unit}', which is no unit of time")
    stamps_s: Value = names.value_of(clock.time, NoTime()) * unit.factor
    if stamps_s.ndim != 1 or len(stamps_s) < 2:
        raise ImportProblemError(
            f"clock '{clock.name}': {clock.time} has the shape {stamps_s.shape}; stamps are one row of two or more"
        )
    if problem := _wrong_stamps(stamps_s, _as_expression(clock.time, names), unit.factor):
        raise ImportProblemError(f"clock '{clock.name}': {clock.time} {problem}")
    rate_hz, places = _uniform(stamps_s, _last_decimal(stamps_s / unit.factor) * unit.factor)
    if places is not None and places[-1] >= MOST_SAMPLES:
        widest = int(np.argmax(np.diff(stamps_s)))
        raise ImportProblemError(
            f"clock '{clock.name}': {clock.time} jumps from {stamps_s[widest]:.9g} to {stamps_s[widest + 1]:.9g} s at "
            f"sample {widest + 1}; at {rate_hz:g} Hz the recording would be {places[-1] + 1:.3g} samples long, most of "
            "them missing. Correct the stamps, or cut the file there into several, which are imported together"
        )
    gap_s = clock.gap_s or _USUAL_GAP * float(np.median(np.diff(stamps_s)))
    if places is not None and not clock.gap_s:
        gap_s = min(gap_s, 1.5 / rate_hz)
    return TimeBase(clock.name, rate_hz, stamps_s, places, gap_s)


def _as_expression(time: str, names: Namespace) -> str:
    return f"array('{time}')" if time in names.arrays and not time.isidentifier() else time


def _wrong_stamps(stamps_s: Value, time: str, unit_s: float) -> str:
    """Problem with the stamps, and the key that corrects it; empty if they increase. time: an expression."""
    if not np.isfinite(stamps_s).all():
        first = int(np.argmax(~np.isfinite(stamps_s)))
        return f"is no number at sample {first}; time is never missing"
    steps_s = np.diff(stamps_s)
    if (steps_s < 0).any():
        first = int(np.argmax(steps_s < 0)) + 1
        back_s = float(-steps_s[first - 1])
        found = f"runs backwards at sample {first}, from {stamps_s[first - 1]:.9g} to {stamps_s[first]:.9g} s"
        usual_s = float(np.median(steps_s))
        turn = next((turn for turn in _COUNTERS if abs(back_s + usual_s - turn * unit_s) < 2 * usual_s), 0)
        if turn and stamps_s.max() < turn * unit_s and stamps_s.min() >= 0:
            return (
                f"{found}, as a counter that begins anew at {turn}; the map's [[clock]] mends it: "
                f'time = "{time} + {turn} * cumsum(diff({time}) < 0)"'
            )
        if abs(back_s - _HOUR_S) > _HOUR_S / 60:
            return f"{found}; put the rows in order, or cut the file there into several, which are imported together"
        mended = f"{time} + {_HOUR_S / unit_s:g} * cumsum(diff({time}) < 0)"
        return f'{found}, as a clock that is set back by an hour; the map\'s [[clock]] mends it: time = "{mended}"'
    if (steps_s == 0).any():
        first = int(np.argmax(steps_s == 0)) + 1
        rate_hz = (len(stamps_s) - 1) / float(np.ptp(stamps_s)) if np.ptp(stamps_s) else 1000.0
        return (
            f"stands still at sample {first}, at {stamps_s[first]:.9g} s; where the sampling was even and only the "
            f"stamps are coarse, state the rate in place of `time` in the map's [[clock]], as in "
            f"rate_hz = {rate_hz:.4g}; where a sample was logged twice with other values, take one of both out"
        )
    ahead = np.flatnonzero(np.abs(steps_s - _HOUR_S) < 10 * float(np.median(steps_s)))
    if len(ahead) == 1 and float(np.median(steps_s)) < _HOUR_S / 1000:
        mended = f"{time} - {_HOUR_S / unit_s:g} * cumsum(diff({time}) > {steps_s[ahead[0]] / 2 / unit_s:.4g})"
        return (
            f"jumps ahead by an hour at sample {ahead[0] + 1}, as a clock that is set to summer time; the map's "
            f'[[clock]] mends it: time = "{mended}"'
        )
    return ""


def _last_decimal(stamps: Value) -> float:
    """Last decimal place of the stamps, such as 0.001; 0 with more decimals."""
    for digits in range(_MOST_DECIMALS + 1):
        whole = stamps * 10**digits
        if (np.abs(whole - np.round(whole)) <= _BINARY).all():
            return float(10**-digits)
    return 0.0


def _uniform(stamps_s: Value, unit_s: float) -> tuple[float, IntArray | None]:
    """Rate and sample indices; 0 and None for non-uniform stamps. A round rate (1000 for 1000.0003) if all stamps agree
    with it. unit_s: last decimal place of the stamps."""
    since_s = stamps_s - stamps_s[0]
    mean_hz = (len(stamps_s) - 1) / float(since_s[-1])
    usual_hz = 1 / float(np.median(np.diff(stamps_s)))
    for about_hz in (mean_hz, usual_hz):
        for rate_hz in (*(float(f"{about_hz:.{digits}g}") for digits in _PLAIN_DIGITS), about_hz):
            places = np.round(since_s * rate_hz).astype(np.int64)
            uneven = np.max(np.abs(since_s * rate_hz - places))
            steps = np.diff(places)
            if uneven <= UNEVEN and (steps >= 1).all() and np.mean(steps > 1) <= LEFT_OUT:
                return rate_hz, places
    rate_hz = _estimate_rounded_rate(since_s, unit_s)
    return rate_hz, np.arange(len(stamps_s)) if rate_hz else None


def _estimate_rounded_rate(since_s: Value, unit_s: float) -> float:
    """Rate of stamps without a gap that are uniform up to rounding to their last decimal place; else 0.

    They must all lie within one unit of that place (rounding of two stamps). Among rates with nearly the residual of
    the mean rate, the roundest is taken. Alternatively some steps differ by one unit of a fine decimal from the usual
    one, and no stamp is off by half a step.
    """
    ticks = np.round(np.diff(since_s) / unit_s) if unit_s else np.zeros(1)
    if ticks.min() < 1 or _skips_rows(ticks):
        return 0.0
    numbers = np.arange(len(since_s))
    mean_hz = (len(since_s) - 1) / float(since_s[-1])
    least = float(np.ptp(since_s * mean_hz - numbers)) + UNEVEN
    for rate_hz in (*(float(f"{mean_hz:.{digits}g}") for digits in range(1, max(_PLAIN_DIGITS) + 1)), mean_hz):
        if np.ptp(since_s * rate_hz - numbers) <= min(unit_s * rate_hz * (1 + _BINARY), least):
            return rate_hz
    usual_hz = 1 / float(np.sort(ticks)[len(ticks) // 2] * unit_s)
    off, unit = since_s * usual_hz - numbers, unit_s * usual_hz * (1 + _BINARY)
    wanders = unit <= UNEVEN * (1 + _BINARY) and np.max(np.abs(np.diff(off))) <= unit and np.max(np.abs(off)) < 0.5
    return usual_hz if wanders else 0.0


def _skips_rows(ticks: Value) -> bool:
    """Whether steps are multiples of the shortest one, and no more are longer than a logger skips by chance."""
    usual = LEFT_OUT * len(ticks)
    skipped = np.count_nonzero(ticks > ticks.min())
    return not (ticks % ticks.min()).any() and bool(skipped <= usual + 3 * np.sqrt(usual) + 1)


def without_doubled_rows(clock: ClockMap, names: Namespace) -> tuple[Namespace, str]:
    """The arrays without rows that repeat the one above, and a sentence with their number; unchanged where the time is
    also constant otherwise. Raises ImportProblemError."""
    if not clock.time:
        return names, ""
    stamps: Value = names.value_of(clock.time, NoTime())
    if stamps.ndim != 1 or len(stamps) < 2:
        return names, ""
    standing = np.flatnonzero(stamps[1:] == stamps[:-1]) + 1
    rows = [array for array in names.arrays.values() if _is_row(array, len(stamps)) and not _counts(array)]
    if not len(standing) or not all(_repeats(array, standing) for array in rows):
        return names, ""
    kept = np.delete(np.arange(len(stamps)), standing)
    arrays = {name: array[kept] if _is_row(array, len(stamps)) else array for name, array in names.arrays.items()}
    count = f"{len(standing)} row{'s' if len(standing) > 1 else ''}"
    text = f"Clock '{clock.name}': {count} logged twice (the same stamp, the same values) left out."
    return replace(names, arrays=arrays), text


def _repeats(array: Array, rows: npt.NDArray[np.intp]) -> bool:
    """Whether all rows equal those above them."""
    return np.array_equal(array[rows], array[rows - 1], equal_nan=array.dtype.kind == "f")


@np.errstate(all="ignore")
def _counts(array: Array) -> bool:
    """Whether an array numbers the rows, duplicated ones included."""
    return array.ndim == 1 and array.dtype.kind in "fiu" and bool((array[1:] - array[:-1] == 1).all())


def _is_row(array: Array, count: int) -> bool:
    return array.ndim >= 1 and len(array) == count
