"""Channels of one part of a recording, resampled to one uniform time grid (`resample_part`).

The grid covers the time range in which all channels have samples, within the limits of the part. Channels whose samples
lie on the grid are copied; all others are resampled as the map states. Computed channels are then evaluated on the
grid.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from equalizer.signals.resampling import PASSBAND, TIME_TOLERANCE, Grid, Method, Samples, resample
from equalizer.signals.signal import FloatArray
from study.importing.alignment import Logger
from study.importing.expressions.functions import Value
from study.importing.expressions.namespace import Namespace
from study.importing.map_format.import_map import ChannelMap, ImportMap, PartMap
from study.importing.map_format.map_errors import ImportProblemError
from study.importing.time_base import MAX_SAMPLES

_COMMAND_ADVICE = (
    'A command that moves in straight lines between its samples has resample = "linear" and, at the top of the map, '
    'hold = "linear"; one that stays until the next has "held" and hold = "zero-order"'
)
"""Advice on the resampling of commands and on the matching `hold` of the map."""

ChannelKey = tuple[str, str]
"""Role and name of a channel."""


@dataclass(frozen=True, slots=True, eq=False)
class PartSignals:
    """Channels of one part on a common time grid, in the units of the map."""

    grid: Grid
    columns: Mapping[ChannelKey, FloatArray]
    """Samples by role and name, each (grid.count,); computed channels included."""


@dataclass(frozen=True, slots=True)
class _GridClock:
    """Clock of computed channels: the times of the grid."""

    grid: Grid

    def times_s(self, count: int) -> Value:
        """(count,) times (s). Raises ValueError unless count is that of the grid."""
        if count != self.grid.count:
            raise ValueError(f"{count} samples are not the recording's {self.grid.count}")
        return self.grid.compute_times_s()


def resample_part(
    import_map: ImportMap,
    part: PartMap,
    loggers: tuple[Logger, ...],
    report: Callable[[str], None],
    on_channel: Callable[[], None],
) -> PartSignals:
    """Resample the channels of one part to a common time grid. `report` is called with a sentence for each deviation
    from the file, `on_channel` after each channel. loggers: at least one, aligned to the first. Raises
    ImportProblemError where an expression, the time grid or a resampling is not possible."""
    logger_by_clock = {logger.clock.name: logger for logger in loggers}
    first_clock = loggers[0].clock.name
    sampled_channels: list[tuple[ChannelMap, Samples]] = []
    for channel in import_map.channel:
        logger = logger_by_clock[channel.clock or first_clock]
        values = _read_values(channel, logger, import_map)
        sampled_channels.append((channel, logger.base.make_samples(values)))
    grid = _make_grid(import_map, part, loggers, [samples for _, samples in sampled_channels])
    columns: dict[ChannelKey, FloatArray] = {}
    for channel, samples in sampled_channels:
        columns[channel.role, channel.name] = _put_on_grid(channel, samples, grid, report)
        on_channel()
    for logger in loggers:
        for remark in filter(None, (logger.base.describe_gaps(), logger.base.describe_wander())):
            report(remark)
    for computed in import_map.computed:
        # Of several channels with the same name, the first is used.
        columns_by_name = {name: column for (_, name), column in reversed(columns.items())}
        columns[computed.role, computed.name] = _compute_channel(
            computed.name, computed.value, columns_by_name, grid, loggers[0].namespace
        )
        on_channel()
    return PartSignals(grid, columns)


def _read_values(channel: ChannelMap, logger: Logger, import_map: ImportMap) -> Value:
    """Compute the samples (n,) of a channel on its clock; a single number is repeated. Raises ImportProblemError for
    an expression that cannot be computed, another shape or length, and infinite values."""
    label, values = f"channel '{channel.name}'", _compute_value(channel, logger)
    if values.ndim > 1:
        raise ImportProblemError(
            f"{label}: {channel.value} has the shape {values.shape}; take one row or column, as in {channel.value}[0]"
        )
    count = _count_samples(logger, import_map)
    if np.isinf(values).any():
        raise ImportProblemError(f"{label}: {channel.value} holds infinite values; a missing sample is NaN")
    if values.ndim == 0:
        return np.full(count or 1, float(values))
    if not len(values):
        raise ImportProblemError(f"{label}: {channel.value} holds no samples")
    if count and len(values) != count:
        clock_text = f"clock '{logger.clock.name}'"
        raise ImportProblemError(f"{label}: {channel.value} has {len(values)} samples, but {clock_text} has {count}")
    return values


def _compute_value(channel: ChannelMap, logger: Logger) -> Value:
    """Evaluate the expression of a channel. Raises ImportProblemError, with the channel's name, where it fails."""
    try:
        return logger.namespace.compute_value(channel.value, logger.base)
    except ImportProblemError as error:
        raise ImportProblemError(f"channel '{channel.name}': {error}") from error


def _count_samples(logger: Logger, import_map: ImportMap) -> int:
    """Count the samples of a clock: those of its time stamps, otherwise those of its first channel that is not
    a single number; 0 without one."""
    if logger.base.stamps_s is not None:
        return len(logger.base.stamps_s)
    first_clock = import_map.clock[0].name
    for channel in import_map.channel:
        if (channel.clock or first_clock) == logger.clock.name:
            values = _compute_value(channel, logger)
            if values.ndim == 1:
                return len(values)
    return 0


def _make_grid(
    import_map: ImportMap, part: PartMap, loggers: tuple[Logger, ...], channel_samples: list[Samples]
) -> Grid:
    """Make the grid over the time range common to all channels, within the limits of the part, at the stated rate or
    the highest of the clocks. Raises ImportProblemError for uneven stamps without a stated rate, and for too many or
    too few samples."""
    uneven_loggers = [logger for logger in loggers if not logger.base.rate_hz]
    if uneven_loggers and not import_map.rate_hz:
        steps_ms = np.diff(uneven_loggers[0].base.times_s(0)) * 1e3
        raise ImportProblemError(
            f"clock '{uneven_loggers[0].clock.name}' has uneven stamps (steps of {steps_ms.min():.4g} to "
            f"{steps_ms.max():.4g} ms); state the rate_hz of the recording, and resample (held, band-limited, linear) "
            "of each channel: "
            f"at the top of the map rate_hz = {uneven_loggers[0].base.typical_rate_hz:.4g}, under each [[channel]] "
            f'resample = "linear". {_COMMAND_ADVICE}'
        )
    rate_hz = import_map.rate_hz or max(logger.base.rate_hz for logger in loggers)
    begin_s = max(float(samples.times_s[0]) for samples in channel_samples)
    end_s = min(float(samples.times_s[-1]) for samples in channel_samples)
    if part.stop_s:
        end_s = min(end_s, begin_s + part.stop_s - (1 - TIME_TOLERANCE) / rate_hz)
    begin_s += np.ceil(part.start_s * rate_hz - TIME_TOLERANCE) / rate_hz
    # The grid lies on the samples of a clock with this rate, so that its channels need no resampling.
    for logger in [logger for logger in loggers if logger.base.rate_hz == rate_hz][:1]:
        origin_s = float(logger.base.times_s(1)[0]) + logger.base.offset_s
        begin_s = origin_s + np.ceil((begin_s - origin_s) * rate_hz - TIME_TOLERANCE) / rate_hz
    count = int(np.floor((end_s - begin_s) * rate_hz + TIME_TOLERANCE)) + 1
    if count > MAX_SAMPLES:
        raise ImportProblemError(
            f"{part.file}: {end_s - begin_s:.9g} s at {rate_hz:g} Hz are {count:.3g} samples, more than "
            f"{MAX_SAMPLES:.0e}; state a lower rate_hz, or take parts with start_s and stop_s"
        )
    if count < 2:
        raise ImportProblemError(
            f"{part.file}: no sample remains between {begin_s:g} and {end_s:g} s, where all clocks have samples"
        )
    return Grid(begin_s, rate_hz, count)


def _put_on_grid(channel: ChannelMap, samples: Samples, grid: Grid, report: Callable[[str], None]) -> FloatArray:
    """Put the samples of a channel on the grid (grid.count,): copied where they lie on it, otherwise resampled. Raises
    ImportProblemError where the map does not state how to resample, or the stated method cannot be applied."""
    first_index = (grid.start_s - float(samples.times_s[0])) * grid.rate_hz
    if _has_same_rate(samples, grid) and abs(first_index - round(first_index)) < TIME_TOLERANCE:
        column = samples.values[round(first_index) : round(first_index) + grid.count]
    elif channel.resample == "":
        raise ImportProblemError(
            f"channel '{channel.name}' has to be resampled to {grid.rate_hz:g} Hz; state how: resample = \"held\" for "
            'a command that stays until the next, "band-limited" for a signal sampled behind a filter, or "linear", '
            f"under its [[channel]] in the map.{' ' + _COMMAND_ADVICE if channel.role == 'command' else ''}"
        )
    else:
        column = _resample(channel, channel.resample, samples, grid, report)
    if missing_count := int(np.isnan(column).sum()):
        report(f"{channel.name}: {missing_count} of {len(column)} samples are missing.")
    return column


def _has_same_rate(samples: Samples, grid: Grid) -> bool:
    """Whether two rates differ by less than `TIME_TOLERANCE` periods over the whole grid; False for uneven samples,
    whose rate is 0."""
    return abs(samples.rate_hz / grid.rate_hz - 1) * grid.count < TIME_TOLERANCE


def _resample(
    channel: ChannelMap, method: Method, samples: Samples, grid: Grid, report: Callable[[str], None]
) -> FloatArray:
    """Resample a channel to the grid (grid.count,) and report from which rate and how. Raises ImportProblemError where
    the method cannot be applied to its samples."""
    try:
        column = resample(samples, grid, method)
    except ValueError as error:
        raise ImportProblemError(f"channel '{channel.name}': {error}") from error
    source_hz = samples.rate_hz or 1 / float(np.median(np.diff(samples.times_s)))
    source_text = f"{samples.rate_hz:.6g} Hz" if samples.rate_hz else f"uneven stamps (about {source_hz:.4g} Hz)"
    band_text = f", flat to {PASSBAND / 2 * min(source_hz, grid.rate_hz):.4g} Hz" if method == "band-limited" else ""
    report(f"{channel.name}: resampled from {source_text} to {grid.rate_hz:.6g} Hz, {method}{band_text}.")
    return column


def _compute_channel(
    channel_name: str, expression: str, columns: Mapping[str, FloatArray], grid: Grid, file_namespace: Namespace
) -> FloatArray:
    """Evaluate the expression of a computed channel on the grid (grid.count,); a single number is repeated. columns:
    the channels by name. Raises ImportProblemError for an expression that cannot be computed, another shape, and
    infinite values."""
    arrays = {**file_namespace.arrays, "clock_s": grid.compute_times_s(), "rate_hz": np.array(grid.rate_hz), **columns}
    try:
        value = Namespace(
            arrays, file_namespace.definitions, file_namespace.file_name, file_namespace.budget
        ).compute_value(expression, _GridClock(grid))
    except ImportProblemError as error:
        raise ImportProblemError(f"computed channel '{channel_name}': {error}") from error
    if np.isinf(value).any():
        raise ImportProblemError(f"computed channel '{channel_name}': {expression} holds infinite values")
    if value.ndim == 0:
        return np.full(grid.count, float(value))
    if value.shape != (grid.count,):
        raise ImportProblemError(
            f"computed channel '{channel_name}': {expression} has the shape {value.shape}, but the recording has "
            f"{grid.count} samples"
        )
    return value
