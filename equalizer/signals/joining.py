"""Concatenates recordings that were made one after another."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from equalizer.signals.recording import Recording, Segment
from equalizer.signals.recording_checks import collect_signals
from equalizer.signals.signal import Signal


def join(parts: Sequence[Recording], meta: Mapping[str, Any]) -> Recording:
    """All parts end to end; their segments move along. Time stamps are dropped, because there were pauses; a signal
    that one of the parts lacks is dropped, too (`signals_left_out`).

    Raises ValueError for no parts, or for parts of different devices, rates, holds of the command, or channels.
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


def signals_left_out(parts: Sequence[Recording]) -> tuple[str, ...]:
    """Names of the signals that some parts have and others lack, so that `join` drops them."""
    names = [set(collect_signals(part)) for part in parts]
    return tuple(sorted(set().union(*names) - names[0].intersection(*names))) if names else ()


def _shift_segment(segment: Segment, offset: int) -> Segment:
    return replace(segment, start=segment.start + offset, stop=segment.stop + offset)


def concatenate_if_all(signals: Sequence[Signal | None]) -> Signal | None:
    """The signals end to end; None where one of them is missing."""
    recorded = [signal for signal in signals if signal is not None]
    return concatenate(recorded) if len(recorded) == len(signals) else None


def concatenate(signals: Sequence[Signal]) -> Signal:
    """The signals end to end. Raises ValueError where channels or units differ."""
    first = signals[0]
    if any((s.channels, s.unit) != (first.channels, first.unit) for s in signals):
        raise ValueError(f"not all parts have the channels {', '.join(first.channels)} in {first.unit}")
    return replace(first, samples=np.concatenate([s.samples for s in signals]))
