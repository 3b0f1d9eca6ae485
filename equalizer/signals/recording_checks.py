"""Consistency checks of a recording: lengths, rates, channels, segments and time stamps."""

from collections.abc import Iterator, Sequence

import numpy as np

from equalizer.signals.recording import SEGMENT_KINDS, SEGMENT_ROLES, Recording, Segment
from equalizer.signals.signal import FloatArray, Signal


def check_recording(recording: Recording) -> tuple[str, ...]:
    """Sentences, one for everything that contradicts the format. Empty = consistent. NaN counts as missing, not as
    wrong."""
    problems = [*_signal_problems(recording), *segment_problems(recording.segments, len(recording))]
    if recording.time_s is not None:
        problems.extend(_time_problems(recording.time_s, len(recording)))
    return tuple(problems)


def signals_of(recording: Recording) -> dict[str, Signal]:
    """The signals that the recording has, by their names in the file format."""
    signals = {
        "command": recording.command,
        "response": recording.response,
        "position": recording.position,
        "excitation": recording.excitation,
        "condition": recording.condition,
    }
    return {name: signal for name, signal in signals.items() if signal is not None}


def channels_text(signal: Signal) -> str:
    """The channels with their units: "fx (N), fy (N)"."""
    return ", ".join(f"{name} ({unit})" for name, unit in zip(signal.channels, signal.units, strict=True))


def unusable_channels(signals: Sequence[Signal]) -> Iterator[tuple[str, bool]]:
    """Channels that hold no number in any of the signals, or that never change: name, and whether it holds none.
    signals: of the same channels."""
    for channel, name in enumerate(signals[0].channels if signals else ()):
        columns = [signal.samples[:, channel] for signal in signals]
        finite = [column[np.isfinite(column)] for column in columns]
        if not any(len(column) for column in finite):
            yield name, True
        elif all(not len(column) or np.ptp(column) == 0 for column in finite):
            yield name, False


def segment_problems(segments: Sequence[Segment], samples: int) -> Iterator[str]:
    """Sentences on segments outside the recording, with unknown kinds or roles, with an amplitude or period out of
    range, and on overlaps. samples: length of the recording."""
    for number, segment in enumerate(segments, start=1):
        for problem in _problems_of_segment(segment, samples):
            yield f"segment {number} {problem}"
    ordered = sorted(enumerate(segments, start=1), key=lambda item: item[1].start)
    last = ordered[:1]  # of the earlier segments, the one that stops last, with its number
    for number, segment in ordered[1:]:
        earlier_number, earlier = last[0]
        if segment.start < earlier.stop:
            yield (
                f"segments {earlier_number} and {number} overlap (one stops at {earlier.stop}, the other starts at "
                f"{segment.start})"
            )
        if segment.stop > earlier.stop:
            last = [(number, segment)]


def _problems_of_segment(segment: Segment, samples: int) -> Iterator[str]:
    if not 0 <= segment.start < segment.stop:
        yield f"goes from {segment.start} to {segment.stop}; start must be at least 0 and below stop"
    elif segment.stop > samples:
        yield f"stops at {segment.stop}, but the recording has {samples} samples"
    if segment.kind not in SEGMENT_KINDS:
        yield f"has the unknown kind '{segment.kind}'; allowed are {', '.join(SEGMENT_KINDS)}"
    if segment.role not in SEGMENT_ROLES:
        yield f"has the unknown role '{segment.role}'; allowed are fit, test, or empty"
    if not (np.isfinite(segment.amplitude) and segment.amplitude >= 0):
        yield f"has the amplitude {segment.amplitude}; it must be a number that is not negative"
    if segment.period < 0:
        yield f"has the period {segment.period}; it counts samples, and 0 means not periodic"


def _signal_problems(recording: Recording) -> Iterator[str]:
    if len(recording) == 0:
        yield "response holds no samples"
    for name, signal in signals_of(recording).items():
        if len(signal) != len(recording):
            yield f"{name} has {len(signal)} samples, but response has {len(recording)}; all must be equally long"
        if signal.sample_rate_hz != recording.sample_rate_hz:
            yield f"{name} is at {signal.sample_rate_hz:g} Hz, but response at {recording.sample_rate_hz:g} Hz"
        if not signal.channels:
            yield f"{name} has no channels"
        if len(set(signal.channels)) != len(signal.channels):
            yield f"{name} names a channel twice: {', '.join(signal.channels)}"
        if np.isinf(signal.samples).any():
            yield f"{name} holds infinite values; a missing sample is NaN"
    if recording.excitation is not None and recording.excitation.channels != recording.command.channels:
        yield (
            f"excitation has the channels {', '.join(recording.excitation.channels)}, but command has "
            f"{', '.join(recording.command.channels)}; excitation is the part of the command decided beforehand"
        )


def _time_problems(time_s: FloatArray, samples: int) -> Iterator[str]:
    if time_s.shape != (samples,):
        yield f"time_s has shape {time_s.shape}, but must be ({samples},), one stamp per sample"
    elif not np.isfinite(time_s).all():
        yield "time_s holds values that are not numbers; leave it out if the stamps are not known"
    elif (np.diff(time_s) <= 0).any():
        yield f"time_s does not grow at sample {int(np.argmax(np.diff(time_s) <= 0)) + 1}"
