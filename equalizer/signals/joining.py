"""Concatenation of recordings that were made one after another, and of their signals.

Called by the recording and import of data (`study.workflows.recording`) and by
`study.evaluation.real.injected_halves`.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from equalizer.signals.recording import Recording, Segment
from equalizer.signals.recording_checks import collect_signals
from equalizer.signals.signal import Signal


def join_recordings(parts: Sequence[Recording], meta: Mapping[str, Any]) -> Recording:
    """Join all parts end to end; the sample indices of their segments are shifted accordingly. Time stamps are dropped,
    because there were pauses; a signal that one of the parts lacks is dropped, too (`list_dropped_signals`). meta:
    metadata of the result.

    Raises ValueError for no parts, or for parts of different devices, rates, holds of the command, channels, or units.
    """
    if not parts:
        raise ValueError("there is nothing to join; give at least one recording")
    first_part = parts[0]
    for part in parts[1:]:
        if (part.device, part.sample_rate_hz) != (first_part.device, first_part.sample_rate_hz):
            raise ValueError(
                f"a recording of {part.device} at {part.sample_rate_hz:g} Hz cannot follow one of {first_part.device} "
                f"at {first_part.sample_rate_hz:g} Hz"
            )
        if part.hold is not first_part.hold:
            raise ValueError(
                f"a command held by {part.hold.value} cannot follow one held by {first_part.hold.value}: a recording "
                "has a single hold"
            )
    start_samples = np.concatenate([[0], np.cumsum([len(part) for part in parts])])
    segments = [
        _shift_segment(segment, int(start_sample))
        for part, start_sample in zip(parts, start_samples, strict=False)
        for segment in part.segments
    ]
    return Recording(
        device=first_part.device,
        command=concatenate_signals([part.command for part in parts]),
        response=concatenate_signals([part.response for part in parts]),
        position=concatenate_if_all_present([part.position for part in parts]),
        excitation=concatenate_if_all_present([part.excitation for part in parts]),
        condition=concatenate_if_all_present([part.condition for part in parts]),
        hold=first_part.hold,
        segments=tuple(segments),
        meta=meta,
    )


def list_dropped_signals(parts: Sequence[Recording]) -> tuple[str, ...]:
    """List the names of the signals that some parts have and others lack, so that `join_recordings` drops them, in
    alphabetical order; none without parts."""
    signal_names_by_part = [set(collect_signals(part)) for part in parts]
    return (
        tuple(sorted(set().union(*signal_names_by_part) - signal_names_by_part[0].intersection(*signal_names_by_part)))
        if signal_names_by_part
        else ()
    )


def _shift_segment(segment: Segment, offset_samples: int) -> Segment:
    """Shift the sample indices of a segment by `offset_samples`."""
    return replace(segment, start=segment.start + offset_samples, stop=segment.stop + offset_samples)


def concatenate_if_all_present(signals: Sequence[Signal | None]) -> Signal | None:
    """Concatenate the signals; None where one of them is missing. Raises ValueError as `concatenate_signals` does."""
    present_signals = [signal for signal in signals if signal is not None]
    return concatenate_signals(present_signals) if len(present_signals) == len(signals) else None


def concatenate_signals(signals: Sequence[Signal]) -> Signal:
    """Concatenate the samples of at least one signal. Raises ValueError where channels or units differ."""
    first_signal = signals[0]
    if any((signal.channels, signal.unit) != (first_signal.channels, first_signal.unit) for signal in signals):
        raise ValueError(f"not all parts have the channels {', '.join(first_signal.channels)} in {first_signal.unit}")
    return replace(first_signal, samples=np.concatenate([signal.samples for signal in signals]))
