"""A logger's time: from a rate, or from stamps, which are checked before anything is built on them."""

from dataclasses import dataclass

import numpy as np

from equalizer.signals.units import UnknownUnitError, parse_unit
from study.importing.functions import Value
from study.importing.import_map import ClockMap
from study.importing.map_errors import ImportProblemError
from study.importing.namespace import Namespace, NoTime

UNEVEN = 0.02
"""Stamps are uniform where none is further from its place than this share of a step."""
_PLAIN_DIGITS = (4, 5, 6)


@dataclass(frozen=True, slots=True, eq=False)
class TimeBase:
    """Of one clock in one part."""

    name: str
    rate_hz: float
    """0 where stamps are not uniform."""
    stamps_s: Value | None
    """(n,) as the logger wrote them; None for a clock that is a rate only."""
    gap_s: float
    offset_s: float = 0.0
    """Added to give the reference's time."""

    @property
    def fastest_hz(self) -> float:
        return self.rate_hz or 1 / float(np.median(np.diff(self.times_s(0))))

    def times_s(self, count: int) -> Value:
        """(count,); with stamps, as many as there are."""
        if self.stamps_s is None:
            return np.arange(count) / self.rate_hz
        if self.rate_hz:
            return self.stamps_s[0] + np.arange(len(self.stamps_s)) / self.rate_hz
        return self.stamps_s


def time_base(clock: ClockMap, names: Namespace) -> TimeBase:
    """Without its offset to other clocks. Raises ImportProblemError."""
    if clock.time:
        return _from_stamps(clock, names)
    rate_hz = clock.rate_hz or names.number(clock.rate)
    if not rate_hz > 0:
        raise ImportProblemError(f"clock '{clock.name}': its rate, {clock.rate}, is {rate_hz:g}; it must be above 0")
    return TimeBase(clock.name, rate_hz, None, clock.gap_s or 1.5 / rate_hz)


def _from_stamps(clock: ClockMap, names: Namespace) -> TimeBase:
    try:
        unit = parse_unit(clock.time_unit)
    except UnknownUnitError as error:
        raise ImportProblemError(f"clock '{clock.name}': time_unit: {error}") from error
    if unit.si != "s":
        raise ImportProblemError(f"clock '{clock.name}': time_unit is '{clock.time_unit}', which is no unit of time")
    stamps_s = names.value_of(clock.time, NoTime()) * unit.factor
    if stamps_s.ndim != 1 or len(stamps_s) < 2:
        raise ImportProblemError(
            f"clock '{clock.name}': {clock.time} has the shape {stamps_s.shape}; stamps are one row of two or more"
        )
    _check(clock, stamps_s)
    steps_s = np.diff(stamps_s)
    rate_hz = _uniform_rate_hz(stamps_s)
    return TimeBase(clock.name, rate_hz, stamps_s, clock.gap_s or 3 * float(np.median(steps_s)))


def _check(clock: ClockMap, stamps_s: Value) -> None:
    if not np.isfinite(stamps_s).all():
        first = int(np.argmax(~np.isfinite(stamps_s)))
        raise ImportProblemError(
            f"clock '{clock.name}': {clock.time} has no number at sample {first}; time is never missing"
        )
    steps_s = np.diff(stamps_s)
    if (steps_s < 0).any():
        first = int(np.argmax(steps_s < 0)) + 1
        raise ImportProblemError(
            f"clock '{clock.name}': {clock.time} runs backwards at sample {first} ({stamps_s[first - 1]:.9g} to "
            f"{stamps_s[first]:.9g} s)"
        )
    if (steps_s == 0).any():
        first = int(np.argmax(steps_s == 0)) + 1
        raise ImportProblemError(
            f"clock '{clock.name}': {clock.time} stands still at sample {first} ({stamps_s[first]:.9g} s)"
        )


def _uniform_rate_hz(stamps_s: Value) -> float:
    """0 where they are not; a plain number (1000 for 1000.0003) where that fits all stamps as well."""
    count = len(stamps_s) - 1
    mean_hz = count / float(stamps_s[-1] - stamps_s[0])
    for rate_hz in (*(float(f"{mean_hz:.{digits}g}") for digits in _PLAIN_DIGITS), mean_hz):
        places = (stamps_s - stamps_s[0]) * rate_hz
        if np.max(np.abs(places - np.arange(count + 1))) <= UNEVEN:
            return rate_hz
    return 0.0
