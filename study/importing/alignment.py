"""Align the clocks of several loggers to the first: by a stated offset, a trigger, or cross-correlation of one
motion in both. Called by `build_recording`."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from analysis.wording import format_number, typeset
from equalizer.signals.clock_offset import NoOffsetError, find_clock_offset
from study.importing.expressions.functions import Value
from study.importing.expressions.namespace import Namespace
from study.importing.map_format.import_map import ClockMap
from study.importing.map_format.map_errors import ImportProblemError
from study.importing.time_base import TimeBase


@dataclass(frozen=True, slots=True)
class Logger:
    """A clock, the arrays recorded with it, and its time base."""

    clock: ClockMap
    """Its clock, as the map states it."""
    names: Namespace
    """Arrays of its file, by name."""
    base: TimeBase
    """Times of its samples."""

    def compute_values(self, text: str) -> Value:
        """Compute the values (n,) of an expression over the arrays. Raises ImportProblemError for another shape, or a
        length other than that of the stamps."""
        values = self.names.compute_value(text, self.base)
        if values.ndim != 1:
            raise ImportProblemError(f"clock '{self.clock.name}': {text} has the shape {values.shape}, not one row")
        if self.base.stamps_s is not None and len(values) != len(self.base.stamps_s):
            raise ImportProblemError(
                f"clock '{self.clock.name}': {text} has {len(values)} samples, but the clock {len(self.base.stamps_s)}"
            )
        return values


def align_signals(loggers: tuple[Logger, ...], report: Callable[[str], None]) -> tuple[Logger, ...]:
    """Align all clocks to that of the first logger: returns the loggers with the offsets (s) of their clocks. `report`
    is called with a sentence for each offset. Raises ImportProblemError."""
    first, *other_loggers = loggers
    return (first, *(_with_offset(first, logger, report) for logger in other_loggers))


def _with_offset(first: Logger, logger: Logger, report: Callable[[str], None]) -> Logger:
    """The logger with the offset that the map asks for: by correlation, by a trigger, or as stated."""
    clock = logger.clock
    if clock.align:
        offset_s, method = _align_by_correlation(first, logger)
    elif clock.trigger:
        offset_s, method = _align_by_trigger(first, logger)
    else:
        offset_s, method = clock.offset_s, "as the map states"
    offset_text = typeset(f"{offset_s * 1e3:.4g}")
    report(f"Clock '{clock.name}' is moved by {offset_text} ms to that of '{first.clock.name}', {method}.")
    return replace(logger, base=replace(logger.base, offset_s=offset_s))


def _align_by_correlation(first: Logger, logger: Logger) -> tuple[float, str]:
    """Offset (s) from the cross-correlation of one motion on both clocks, and how it was found, in words. Raises
    ImportProblemError."""
    clock = logger.clock
    reference = first.base.make_samples(first.compute_values(clock.align_to))
    aligned = logger.base.make_samples(logger.compute_values(clock.align))
    try:
        best_match = find_clock_offset(reference, aligned, clock.offset_s, clock.align_within_s)
    except ValueError as error:
        reason_prefix = "" if isinstance(error, NoOffsetError) else "correlation is not possible: "
        raise ImportProblemError(f"clock '{clock.name}' cannot be aligned: {reason_prefix}{error}") from error
    sign_text = ", its sign turned" if best_match.correlation < 0 else ""
    method = (
        f"found by correlating {clock.align} with {clock.align_to} "
        f"({format_number(best_match.correlation, 3)} there{sign_text})"
    )
    return best_match.offset_s, method


def _align_by_trigger(first: Logger, logger: Logger) -> tuple[float, str]:
    """Offset (s) between the crossings of the trigger levels on both clocks, and how it was found, in words. Raises
    ImportProblemError."""
    clock = logger.clock
    trigger_s = _find_crossing_s(logger, clock.trigger, clock.trigger_level)
    reference_s = _find_crossing_s(first, clock.reference_trigger, clock.reference_level)
    return reference_s - trigger_s, f"from the trigger in {clock.trigger} and {clock.reference_trigger}"


def _find_crossing_s(logger: Logger, text: str, level: float) -> float:
    """Time (s) at which the signal first crosses the level, upwards or downwards, by linear interpolation. Raises
    ImportProblemError without a crossing, or where samples at it are missing."""
    values: Any = logger.compute_values(text)
    times_s = logger.base.times_s(len(values))
    finite_indices = np.flatnonzero(np.isfinite(values))
    is_above = values[finite_indices] >= level
    crossings = np.flatnonzero(is_above[1:] != is_above[:-1])
    if not len(crossings):
        raise ImportProblemError(f"clock '{logger.clock.name}': {text} never passes the trigger level of {level:g}")
    index, next_index = (int(sample) for sample in finite_indices[crossings[0] : crossings[0] + 2])
    if next_index > index + 1:
        raise ImportProblemError(
            f"clock '{logger.clock.name}': {text} passes the trigger level of {level:g} where samples are missing, "
            f"between {index} and {next_index}; fill them, or state offset_s in place of the trigger"
        )
    fraction = (level - values[index]) / (values[index + 1] - values[index])
    return float(times_s[index] + fraction * (times_s[index + 1] - times_s[index]))
