"""Align the clocks of several loggers to the first: by a stated offset, a trigger, or cross-correlation of one
motion in both. Begin at `align_signals`."""

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
    namespace: Namespace
    """Arrays of its file, by name."""
    base: TimeBase
    """Times of its samples."""

    def compute_values(self, expression: str) -> Value:
        """Compute the values (n,) of an expression over the arrays. Raises ImportProblemError for another shape, no
        value, or a length other than that of the clock's time stamps."""
        values = self.namespace.compute_value(expression, self.base)
        if values.ndim != 1:
            raise ImportProblemError(
                f"clock '{self.clock.name}': {expression} has the shape {values.shape}, not one row"
            )
        if not len(values):
            raise ImportProblemError(f"clock '{self.clock.name}': {expression} holds no samples")
        if self.base.stamps_s is not None and len(values) != len(self.base.stamps_s):
            raise ImportProblemError(
                f"clock '{self.clock.name}': {expression} has {len(values)} samples, "
                f"but the clock {len(self.base.stamps_s)}"
            )
        return values


def align_signals(loggers: tuple[Logger, ...], report_sentence: Callable[[str], None]) -> tuple[Logger, ...]:
    """Align all clocks to that of the first logger: returns the loggers with the offsets (s) of their clocks.
    report_sentence: called with a sentence for each logger but the first. Raises ImportProblemError where a
    correlation or a trigger gives no offset, or its expression no signal."""
    first_logger, *other_loggers = loggers
    return (first_logger, *(_set_clock_offset(first_logger, logger, report_sentence) for logger in other_loggers))


def _set_clock_offset(first_logger: Logger, logger: Logger, report_sentence: Callable[[str], None]) -> Logger:
    """Set the offset that the map asks for: by correlation, else by a trigger, else as stated. Returns a new logger."""
    clock = logger.clock
    if clock.align:
        offset_s, method = _align_by_correlation(first_logger, logger)
    elif clock.trigger:
        offset_s, method = _align_by_trigger(first_logger, logger)
    else:
        offset_s, method = clock.offset_s, "as the map states"
    offset_ms_text = typeset(f"{offset_s * 1e3:.4g}")
    report_sentence(
        f"Clock '{clock.name}' is moved by {offset_ms_text} ms to that of '{first_logger.clock.name}', {method}."
    )
    return replace(logger, base=replace(logger.base, offset_s=offset_s))


def _align_by_correlation(first_logger: Logger, logger: Logger) -> tuple[float, str]:
    """Find the offset (s) by the cross-correlation of one motion on both clocks; returns it and the method in words.
    Raises ImportProblemError where the correlation gives no offset."""
    clock = logger.clock
    reference_motion = first_logger.base.make_samples(first_logger.compute_values(clock.align_to))
    aligned_motion = logger.base.make_samples(logger.compute_values(clock.align))
    try:
        best_match = find_clock_offset(reference_motion, aligned_motion, clock.offset_s, clock.align_within_s)
    except ValueError as error:
        reason_prefix = "" if isinstance(error, NoOffsetError) else "correlation is not possible: "
        raise ImportProblemError(f"clock '{clock.name}' cannot be aligned: {reason_prefix}{error}") from error
    sign_text = ", its sign turned" if best_match.correlation < 0 else ""
    method = (
        f"found by correlating {clock.align} with {clock.align_to} "
        f"({format_number(best_match.correlation, 3)} there{sign_text})"
    )
    return best_match.offset_s, method


def _align_by_trigger(first_logger: Logger, logger: Logger) -> tuple[float, str]:
    """Find the offset (s) by the first crossings of the trigger levels: time on the first clock minus time on this one;
    returns it and the method in words. Raises ImportProblemError where `_find_crossing_s` does."""
    clock = logger.clock
    trigger_s = _find_crossing_s(logger, clock.trigger, clock.trigger_level)
    reference_s = _find_crossing_s(first_logger, clock.reference_trigger, clock.reference_level)
    return reference_s - trigger_s, f"from the trigger in {clock.trigger} and {clock.reference_trigger}"


def _find_crossing_s(logger: Logger, expression: str, trigger_level: float) -> float:
    """Find the time (s) at which the signal first crosses the level, upwards or downwards, by linear interpolation.
    Raises ImportProblemError without a crossing, or where samples at it are missing."""
    values: Any = logger.compute_values(expression)
    times_s = logger.base.times_s(len(values))
    finite_indices = np.flatnonzero(np.isfinite(values))
    is_above = values[finite_indices] >= trigger_level
    crossings = np.flatnonzero(is_above[1:] != is_above[:-1])
    if not len(crossings):
        raise ImportProblemError(
            f"clock '{logger.clock.name}': {expression} never passes the trigger level of {trigger_level:g}"
        )
    index, next_index = (int(sample) for sample in finite_indices[crossings[0] : crossings[0] + 2])
    if next_index > index + 1:
        raise ImportProblemError(
            f"clock '{logger.clock.name}': {expression} passes the trigger level of {trigger_level:g} where samples "
            f"are missing, between {index} and {next_index}; fill them, or state offset_s in place of the trigger"
        )
    fraction = (trigger_level - values[index]) / (values[index + 1] - values[index])
    return float(times_s[index] + fraction * (times_s[index + 1] - times_s[index]))
