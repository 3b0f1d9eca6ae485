"""Detect sensor faults without a model: quantization, clipping (saturation), lost samples (repeated readings).

A healthy device also repeats readings and has a largest one. Reference recordings of the device without the fault
therefore give the usual count of such readings, which a fault must exceed significantly (`is_unusual_count`), and the
usual quantization step.

Sizes: n samples, p response channels. The limits are chosen by hand, unless a reason is stated.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from analysis.diagnosis.data.readings_at_limit import READING_TOLERANCE, is_unusual_count
from analysis.diagnosis.errors.hypothesis import Claim, Hypothesis, Spread, make_claim_hypothesis
from analysis.diagnosis.limits import STEP_FACTOR
from analysis.diagnosis.types import Mask
from equalizer.effects.effect import Effect, Values
from equalizer.effects.starts.lattice import confirm_lattice_step, find_lattice_step
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray

STEP_TOLERANCE = 1e-3
"""Relative difference of the quantization steps of two channels up to which they count as equal."""
LONGEST_MEAN_RUN = 2.0
"""Largest mean length in samples of runs of repeats that are taken for lost samples, as with half of all samples lost
at random: longer runs count as backlash, or a sensor at rest."""
FULL_STEP_SHARE = 0.75
"""Limit of the median step after a repeat, relative to the median of the other steps (`_has_full_steps`)."""
REFERENCE_STRETCH_COUNT = 3
"""Number of stretches into which each reference recording is divided: the largest share of any stretch is usual."""
ChannelFault = tuple[tuple[int, ...], Values]
"""Channels, and the parameters of their fault."""


def find_sensor_faults(
    recordings: Sequence[Recording], reference_recordings: Sequence[Recording], effects: Sequence[Effect]
) -> tuple[Hypothesis, ...]:
    """Find the first fault of quantization, clipping and lost samples, in this order: at most one hypothesis, because
    quantized readings also repeat and accumulate at the largest value. reference_recordings: at least one, with the
    channels of `recordings`, and two or more complete samples per stretch. effects: those that may be named. Empty
    without a fault, and where the fault found first is not among them."""
    effects_by_name = {effect.name: effect for effect in effects}
    readings = _stack_readings(recordings)
    reference_stretches = [
        stretch
        for recording in reference_recordings
        for stretch in np.array_split(_stack_readings([recording]), REFERENCE_STRETCH_COUNT)
        if len(stretch)
    ]
    for name, find_fault in (
        ("quantization", _find_quantization),
        ("sensor_clipping", _find_clipping),
        ("lost_samples", _find_lost_samples),
    ):
        fault = find_fault(readings, reference_stretches)
        if fault is not None:
            return (_make_hypothesis(effects_by_name[name], *fault),) if name in effects_by_name else ()
    return ()


def _make_hypothesis(effect: Effect, channels: tuple[int, ...], values: Values) -> Hypothesis:
    """Make the hypothesis that these response channels (indices) have the fault, with the same parameter values."""
    spread: Spread = "all" if len(channels) > 1 else "one"
    return make_claim_hypothesis(Claim(effect, spread, channels), [values])


def _stack_readings(recordings: Sequence[Recording]) -> FloatArray:
    """Stack the responses of all recordings, (n, p), one after another, without samples in which a channel is
    missing."""
    samples = np.vstack([recording.response.samples for recording in recordings])
    return np.asarray(samples[np.isfinite(samples).all(axis=1)])


def _find_quantization(readings: FloatArray, references: Sequence[FloatArray]) -> ChannelFault | None:
    """Find quantization: readings lie on a lattice whose step is more than `STEP_FACTOR` times that of every reference
    (0 where a reference lies on none). All channels have the fault if all have such a step and these are equal, else
    the one with the largest step. readings: (n, p); references: (samples, p) each."""
    step_by_channel = {}
    for channel in range(readings.shape[1]):
        step = find_lattice_step(readings[:, channel])
        if step is not None and all(
            step > STEP_FACTOR * confirm_lattice_step(reference[:, channel], step) for reference in references
        ):
            step_by_channel[channel] = step
    has_equal_steps = bool(step_by_channel) and min(step_by_channel.values()) > (1 - STEP_TOLERANCE) * max(
        step_by_channel.values()
    )
    return _choose_channels(
        step_by_channel, has_equal_steps and len(step_by_channel) == readings.shape[1], readings.shape[1], "step"
    )


def _find_clipping(readings: FloatArray, references: Sequence[FloatArray]) -> ChannelFault | None:
    """Find clipping: significantly more readings at the largest magnitude than in the references, one of which exceeds
    that magnitude, and no more repeats below it than usual. All channels have the fault if none exceeds the largest
    limit, else the one with the largest limit. readings: (n, p); references: (samples, p) each."""
    limit_by_channel = {}
    for channel in range(readings.shape[1]):
        limit, top_count = _count_top_excess(readings[:, channel])
        usual_count = max(
            _count_top_excess(reference[:, channel])[1] / len(reference) for reference in references
        ) * len(readings)
        largest_reference = max(float(np.abs(reference[:, channel]).max()) for reference in references)
        usual_repeats = max(
            _count_repeats_below_top(reference[:, channel]) / len(reference) for reference in references
        ) * len(readings)
        if (
            limit < largest_reference
            and is_unusual_count(top_count, usual_count)
            and not is_unusual_count(_count_repeats_below_top(readings[:, channel]), usual_repeats)
        ):
            limit_by_channel[channel] = limit
    are_all_clipped = bool(limit_by_channel) and bool(
        np.all(np.abs(readings) <= max(limit_by_channel.values()) * (1 + READING_TOLERANCE))
    )
    return _choose_channels(limit_by_channel, are_all_clipped, readings.shape[1], "limit")


def _count_top_excess(values: FloatArray) -> tuple[float, int]:
    """Return the largest magnitude of one channel, (n,), and the number of readings there less the number at the next
    smaller magnitude."""
    magnitudes = np.abs(values)
    largest_magnitude = float(magnitudes.max())
    is_at_limit = magnitudes >= largest_magnitude * (1 - READING_TOLERANCE)
    smaller_magnitudes = magnitudes[~is_at_limit]
    next_magnitude = smaller_magnitudes.max(initial=0.0) * (1 - READING_TOLERANCE)
    next_level_count = int(np.count_nonzero(smaller_magnitudes >= next_magnitude))
    return largest_magnitude, int(np.count_nonzero(is_at_limit)) - next_level_count


def _count_repeats_below_top(values: FloatArray) -> int:
    """Count the repeated readings below the largest magnitude of one channel, (n,), n >= 2: backlash holds readings at
    any level, clipping at the limit only."""
    magnitudes = np.abs(values[1:])
    return int(np.count_nonzero((np.diff(values) == 0) & (magnitudes < magnitudes.max() * (1 - READING_TOLERANCE))))


def _find_lost_samples(readings: FloatArray, references: Sequence[FloatArray]) -> ChannelFault | None:
    """Find lost samples: significantly more runs of repeats than in the references, short and followed by a full step.
    The parameter is the share of lost samples, less the usual share, and all channels have the fault. readings: (n, p);
    references: (samples, p) each."""
    is_repeat = _mark_repeats(readings)
    usual_count = max(float(_mark_run_starts(_mark_repeats(reference)).mean()) for reference in references) * len(
        is_repeat
    )
    run_count = int(_mark_run_starts(is_repeat).sum())
    if (
        not is_unusual_count(run_count, usual_count)
        or is_repeat.sum() > LONGEST_MEAN_RUN * run_count
        or not _has_full_steps(readings, is_repeat)
    ):
        return None
    fraction = (float(is_repeat.sum()) - usual_count) / len(is_repeat)
    return tuple(range(readings.shape[1])), {"fraction": fraction}


def _has_full_steps(values: FloatArray, is_repeat: Mask) -> bool:
    """Whether the median step after a repeat exceeds `FULL_STEP_SHARE` of the median of the other steps, as after lost
    samples; after backlash it is smaller. True where either kind of step does not occur. values: (n, p); is_repeat: as
    `_mark_repeats` returns it; a step is summed over the channels."""
    step_sizes = np.abs(np.diff(values, axis=0)).sum(axis=1)[1:]
    follows_repeat = is_repeat[:-1] & ~is_repeat[1:]
    is_regular = ~is_repeat[:-1] & ~is_repeat[1:]
    return (
        bool(np.median(step_sizes[follows_repeat]) > FULL_STEP_SHARE * np.median(step_sizes[is_regular]))
        if follows_repeat.any() and is_regular.any()
        else True
    )


def _mark_repeats(values: FloatArray) -> Mask:
    """Mark the readings, from the second on, in which all channels repeat the previous one: (n - 1,)."""
    return np.asarray((np.diff(values, axis=0) == 0).all(axis=1), dtype=np.bool_)


def _mark_run_starts(is_repeat: Mask) -> Mask:
    """Mark the first repeat of each run: (n - 1,)."""
    return np.asarray(is_repeat & ~np.concatenate([[False], is_repeat[:-1]]), dtype=np.bool_)


def _choose_channels(
    parameters: Mapping[int, float], in_all_channels: bool, channel_count: int, parameter_name: str
) -> ChannelFault | None:
    """Choose the channels with the fault: all, or only the one with the largest parameter. parameters: by channel;
    in_all_channels: whether all channels have the fault; parameter_name: for the returned values. None without
    parameters."""
    if not parameters:
        return None
    worst_channel = max(parameters, key=lambda channel: parameters[channel])
    channels = tuple(range(channel_count)) if in_all_channels else (worst_channel,)
    return channels, {parameter_name: parameters[worst_channel]}
