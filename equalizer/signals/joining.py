"""Concatenation of recordings that were made one after another, and of their signals.

Called by the recording and import of data (`study.workflows.recording`).
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from equalizer.signals.recording import Recording, Segment
from equalizer.signals.recording_checks import collect_signals
from equalizer.signals.signal import Signal


def join(parts: Sequence[Recording], meta: Mapping[str, Any]) -> Recording:
    """Join all parts end to end; the sample indices of their segments are shifted accordingly. Time stamps are dropped,
    because there were pauses; a signal that one of the parts lacks is dropped, too (`list_dropped_signals`). meta:
    metadata of the result.

    Raises ValueError for no parts, or for parts of different devices, rates, holds of the command, channels, or units.
    """
    if not parts:
        raise ValueError("there is nothing to join; give at least one recording")
    first = parts[0]
    for part in parts[1:]:
        if (part.device, part.sample_rate_hz) != (first.device, first.sample_rate_hz):
            raise ValueError(
                f"a recording of {part.device} at {part.sample_rate_hz:g} Hz cannot follow one of {first.device} "
                f"at {first.sample_rate_hz:g} Hz"
            )
        if part.hold is not first.hold:
            raise ValueError(
                f"a command held by {part.hold.value} cannot follow one held by {first.hold.value}: a recording has a "
                "single hold"
            )
    starts = np.concatenate([[0], np.cumsum([len(part) for part in parts])])
    segments = [
        _shift_segment(segment, int(start))
        for part, start in zip(parts, starts, strict=False)
        for segment in part.segments
    ]
    return Recording(
        device=first.device,
        command=concatenate([part.command for part in parts]),
        response=concatenate([part.response for part in parts]),
        position=concatenate_if_all([part.position for part in parts]),
        excitation=concatenate_if_all([part.excitation for part in parts]),
        condition=concatenate_if_all([part.condition for part in parts]),
        hold=first.hold,
        segments=tuple(segments),
        meta=meta,
    )


def list_dropped_signals(parts: Sequence[Recording]) -> tuple[str, ...]:
    """List the names of the signals that some parts have and others lack, so that `join` drops them, in alphabetical
    order; none without parts."""
    names = [set(collect_signals(part)) for part in parts]
    return tuple(sorted(set().union(*names) - names[0].intersection(*names))) if names else ()


def _shift_segment(segment: Segment, offset: int) -> Segment:
    """The segment moved by `offset` samples."""
    return replace(segment, start=segment.start + offset, stop=segment.stop + offset)


def concatenate_if_all(signals: Sequence[Signal | None]) -> Signal | None:
    """Concatenate the signals; None where one of them is missing. Raises ValueError as `concatenate` does."""
    present_signals = [signal for signal in signals if signal is not None]
    return concatenate(present_signals) if len(present_signals) == len(signals) else None


def concatenate(signals: Sequence[Signal]) -> Signal:
    """Concatenate the samples of at least one signal. Raises ValueError where channels or units differ."""
    first = signals[0]
    if any((signal.channels, signal.unit) != (first.channels, first.unit) for signal in signals):
        raise ValueError(f"not all parts have the channels {', '.join(first.channels)} in {first.unit}")
    return replace(first, samples=np.concatenate([signal.samples for signal in signals]))
