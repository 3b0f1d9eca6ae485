"""Align the clocks of several loggers to the first: by a stated offset, a trigger, or cross-correlation of one
motion in both."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from analysis.wording import number, typeset
from equalizer.signals.clock_offset import NoOffsetError, offset_by_correlation
from study.importing.expressions.functions import Value
from study.importing.expressions.namespace import Namespace
from study.importing.map_format.import_map import ClockMap
from study.importing.map_format.map_errors import ImportProblemError
from study.importing.time_base import TimeBase


@dataclass(frozen=True, slots=True)
class Logger:
    """A clock, the arrays recorded with it, and its time base."""

    clock: ClockMap
    names: Namespace
    base: TimeBase

    def line(self, text: str) -> Value:
        """Values (n,) of an expression. Raises ImportProblemError for another shape, or a length other than that of the
        stamps."""
        values = self.names.value_of(text, self.base)
        if values.ndim != 1:
            raise ImportProblemError(f"clock '{self.clock.name}': {text} has the shape {values.shape}, not one row")
        if self.base.stamps_s is not None and len(values) != len(self.base.stamps_s):
            raise ImportProblemError(
                f"clock '{self.clock.name}': {text} has {len(values)} samples, but the clock {len(self.base.stamps_s)}"
            )
        return values


def align_signals(loggers: tuple[Logger, ...], say: Callable[[str], None]) -> tuple[Logger, ...]:
    """The loggers with the offsets (s) of their clocks to the clock of the first. `say` is called with a sentence for
    each offset. Raises ImportProblemError."""
    first, *others = loggers
    return (first, *(_with_offset(first, other, say) for other in others))


def _with_offset(first: Logger, other: Logger, say: Callable[[str], None]) -> Logger:
    """The logger with the offset that the map asks for: by correlation, by a trigger, or as stated."""
    clock = other.clock
    if clock.align:
        offset_s, how = _align_by_correlation(first, other)
    elif clock.trigger:
        offset_s, how = _align_by_trigger(first, other)
    else:
        offset_s, how = clock.offset_s, "as the map states"
    moved_ms = typeset(f"{offset_s * 1e3:.4g}")
    say(f"Clock '{clock.name}' is moved by {moved_ms} ms to that of '{first.clock.name}', {how}.")
    return replace(other, base=replace(other.base, offset_s=offset_s))


def _align_by_correlation(first: Logger, other: Logger) -> tuple[float, str]:
    """Offset (s) from the cross-correlation of one motion on both clocks, and how it was found, in words. Raises
    ImportProblemError."""
    clock = other.clock
    reference = first.base.samples(first.line(clock.align_to))
    own = other.base.samples(other.line(clock.align))
    try:
        found = offset_by_correlation(reference, own, clock.offset_s, clock.align_within_s)
    except ValueError as error:
        kind = "" if isinstance(error, NoOffsetError) else "correlation is not possible: "
        raise ImportProblemError(f"clock '{clock.name}' cannot be aligned: {kind}{error}") from error
    turned = ", its sign turned" if found.correlation < 0 else ""
    how = f"found by correlating {clock.align} with {clock.align_to} ({number(found.correlation, 3)} there{turned})"
    return found.offset_s, how


def _align_by_trigger(first: Logger, other: Logger) -> tuple[float, str]:
    """Offset (s) between the crossings of the trigger levels on both clocks, and how it was found, in words."""
    clock = other.clock
    here_s = _find_crossing_s(other, clock.trigger, clock.trigger_level)
    there_s = _find_crossing_s(first, clock.reference_trigger, clock.reference_level)
    return there_s - here_s, f"from the trigger in {clock.trigger} and {clock.reference_trigger}"


def _find_crossing_s(logger: Logger, text: str, level: float) -> float:
    """Time (s) at which the signal first crosses the level, upwards or downwards, by linear interpolation. Raises
    ImportProblemError without a crossing."""
    values: Any = logger.line(text)
    times_s = logger.base.times_s(len(values))
    known = np.flatnonzero(np.isfinite(values))
    above = values[known] >= level
    change = np.flatnonzero(above[1:] != above[:-1])
    if not len(change):
        raise ImportProblemError(f"clock '{logger.clock.name}': {text} never passes the trigger level of {level:g}")
    k, after = (int(place) for place in known[change[0] : change[0] + 2])
    if after > k + 1:
        raise ImportProblemError(
            f"clock '{logger.clock.name}': {text} passes the trigger level of {level:g} where samples are missing, "
            f"between {k} and {after}; fill them, or state offset_s in place of the trigger"
        )
    share = (level - values[k]) / (values[k + 1] - values[k])
    return float(times_s[k] + share * (times_s[k + 1] - times_s[k]))
