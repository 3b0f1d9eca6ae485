"""Consistency checks of a recording: lengths, rates, channels, segments, time stamps.

`study.store.formats.recording_file` and `study.importing.build_recording` call `check_recording` when they read or
import a recording. Identification, fits and diagnosis call `list_recording_problems`, because a recording may also be
made of arrays, and `find_unusable_channels`. An import calls `find_duplicates`, too.
"""

from collections.abc import Iterator, Sequence
from hashlib import sha256
from numbers import Integral

import numpy as np
import numpy.typing as npt

from equalizer.signals.recording import SEGMENT_KINDS, SEGMENT_ROLES, Recording, Segment
from equalizer.signals.signal import Signal
from equalizer.signals.units import UnknownUnitError, parse_unit


def check_recording(recording: Recording) -> tuple[str, ...]:
    """Check a recording against the format. Returns a sentence per problem; empty if there is none. NaN means a missing
    sample, which is allowed."""
    problem_sentences = [*_check_signals(recording), *find_segment_problems(recording.segments, len(recording))]
    if recording.time_s is not None:
        problem_sentences.extend(_check_time_stamps(recording.time_s, len(recording)))
    return tuple(problem_sentences)


def list_recording_problems(recordings: Sequence[Recording], names: Sequence[str] = ()) -> tuple[str, ...]:
    """List the problems of `check_recording`, and units outside SI (a file's are converted when it is read); without
    any, the duplicates (`find_duplicates`). A sentence each, with the recording's name where there are several. names:
    empty = recording 1, recording 2 and so on."""
    names = names or [f"recording {number}" for number in range(1, len(recordings) + 1)]
    problems = tuple(
        problem if len(recordings) == 1 else f"{name}: {problem}"
        for recording, name in zip(recordings, names, strict=True)
        for problem in (*check_recording(recording), *_find_foreign_units(recording))
    )
    # Those that differ in rate, hold, channels or units are refused for that, by the callers.
    contents = [
        (
            (repr(each.sample_rate_hz), each.hold.value, format_channels(each.command), format_channels(each.response)),
            each.command.samples,
            each.response.samples,
        )
        for each in recordings
    ]
    return problems or tuple(find_duplicates(contents, names))


def find_duplicates(contents: Sequence[Sequence[npt.ArrayLike]], names: Sequence[str]) -> Iterator[str]:
    """Find recordings with the same content as an earlier one, as of a file that is given twice: they would count
    twice, and a model would be tested by the data that it was fitted to. Those of a device at rest, whose channels are
    all constant, may be alike. Yields a sentence per such recording. contents: of each, its commands and responses."""
    if len(contents) < 2:
        return
    first_names: dict[bytes, str] = {}
    for arrays, name in zip(contents, names, strict=True):
        content_hash = sha256()
        for array in arrays:
            content_hash.update(np.ascontiguousarray(array).tobytes())
        digest = content_hash.digest()
        if digest in first_names and not all(map(_is_constant, arrays)):
            yield f"{name} holds the same samples as {first_names[digest]}, and a recording counts once: leave it out"
        first_names.setdefault(digest, name)


def _is_constant(array: npt.ArrayLike) -> bool:
    """Whether an array of samples (n,) or (n, channels) is constant; True for texts, which are no samples."""
    samples = np.asarray(array)
    return samples.dtype.kind == "U" or bool((samples == samples[:1]).all())


def _find_foreign_units(recording: Recording) -> Iterator[str]:
    """Find units that are not in SI, or not units. Yields a sentence per channel."""
    for name, signal in collect_signals(recording).items():
        for channel, unit in zip(signal.channels, signal.units, strict=True):
            try:
                parsed_unit = parse_unit(unit)
            except UnknownUnitError as error:
                yield f"{name} {channel}: {error}"
                continue
            if parsed_unit.si == unit:
                continue
            if (parsed_unit.factor, parsed_unit.offset) == (1.0, 0.0):
                yield f"{name} {channel} is in {unit}; state that unit as {parsed_unit.si}"
            else:
                yield (
                    f"{name} {channel} is in {unit}; convert its samples to SI, here {parsed_unit.si}, and state that "
                    "unit"
                )


def collect_signals(recording: Recording) -> dict[str, Signal]:
    """Collect the signals of the recording by their names in the file format; absent ones are left out."""
    signals = {
        "command": recording.command,
        "response": recording.response,
        "position": recording.position,
        "excitation": recording.excitation,
        "condition": recording.condition,
    }
    return {name: signal for name, signal in signals.items() if signal is not None}


def format_channels(signal: Signal) -> str:
    """Format the channels of a signal with their units: "fx (N), fy (N)", for messages."""
    return ", ".join(f"{name} ({unit})" for name, unit in zip(signal.channels, signal.units, strict=True))


def find_unusable_channels(signals: Sequence[Signal]) -> Iterator[tuple[str, bool]]:
    """Find channels without a finite value in any of the signals, or with constant finite values in each. Yields the
    channel's name and whether it has no finite value. signals: all with the same channels."""
    for index, name in enumerate(signals[0].channels if signals else ()):
        columns = [signal.samples[:, index] for signal in signals]
        finite_columns = [column[np.isfinite(column)] for column in columns]
        if not any(len(column) for column in finite_columns):
            yield name, True
        elif all(not len(column) or np.ptp(column) == 0 for column in finite_columns):
            yield name, False


def find_segment_problems(segments: Sequence[Segment], sample_count: int) -> Iterator[str]:
    """Find segments outside the recording, with unknown kind or role, with an amplitude or period out of range, and
    overlapping segments. Yields a sentence per problem. sample_count: length of the recording."""
    for number, segment in enumerate(segments, start=1):
        for problem in _check_segment(segment, sample_count):
            yield f"segment {number} {problem}"
    segments_by_start = sorted(enumerate(segments, start=1), key=lambda numbered_segment: numbered_segment[1].start)
    latest_ending = segments_by_start[:1]  # the earlier segment that stops last, with its number; a list of at most 1
    for number, segment in segments_by_start[1:]:
        earlier_number, earlier = latest_ending[0]
        if segment.start < earlier.stop:
            yield (
                f"segments {earlier_number} and {number} overlap (one stops at {earlier.stop}, the other starts at "
                f"{segment.start})"
            )
        if segment.stop > earlier.stop:
            latest_ending = [(number, segment)]


def _check_segment(segment: Segment, sample_count: int) -> Iterator[str]:
    """Check a segment. Yields a predicate per problem, such as "stops at 12, but ...", to follow the segment's name."""
    if not all(isinstance(count, Integral) for count in (segment.start, segment.stop, segment.period)):
        yield f"has the start, stop or period {segment.start}, {segment.stop}, {segment.period}; give whole numbers"
    if not 0 <= segment.start < segment.stop:
        yield f"goes from {segment.start} to {segment.stop}; start must be at least 0 and below stop"
    elif segment.stop > sample_count:
        yield f"stops at {segment.stop}, but the recording has {sample_count} samples"
    if segment.kind not in SEGMENT_KINDS:
        yield f"has the unknown kind '{segment.kind}'; allowed are {', '.join(SEGMENT_KINDS)}"
    if segment.role not in SEGMENT_ROLES:
        yield f"has the unknown role '{segment.role}'; allowed are fit, test, or empty"
    if not (np.isfinite(segment.amplitude) and segment.amplitude >= 0):
        yield f"has the amplitude {segment.amplitude}; it must be a number that is not negative"
    if segment.period < 0:
        yield f"has the period {segment.period}; it counts samples, and 0 means not periodic"


def find_length_problems(recording: Recording) -> Iterator[str]:
    """Find signals of another length or rate than the response. Yields a sentence per problem."""
    for name, signal in collect_signals(recording).items():
        if len(signal) != len(recording):
            yield f"{name} has {len(signal)} samples, but response has {len(recording)}; all must be equally long"
        if signal.sample_rate_hz != recording.sample_rate_hz:
            yield f"{name} is at {signal.sample_rate_hz:.12g} Hz, but response at {recording.sample_rate_hz:.12g} Hz"


def _check_signals(recording: Recording) -> Iterator[str]:
    """Check lengths, rates, channels and values of all signals. Yields a sentence per problem."""
    if len(recording) == 0:
        yield "response holds no samples"
    yield from find_length_problems(recording)
    for name, signal in collect_signals(recording).items():
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


def _check_time_stamps(time_stamps_s: npt.ArrayLike, sample_count: int) -> Iterator[str]:
    """Check time stamps (s): one per sample, finite, strictly increasing. Yields a sentence for the first problem."""
    time_s = np.asarray(time_stamps_s, dtype=np.float64)
    if time_s.shape != (sample_count,):
        yield f"time_s has shape {time_s.shape}, but must be ({sample_count},), one stamp per sample"
    elif not np.isfinite(time_s).all():
        yield "time_s holds values that are not numbers; leave it out if the stamps are not known"
    elif (np.diff(time_s) <= 0).any():
        yield f"time_s does not grow at sample {int(np.argmax(np.diff(time_s) <= 0)) + 1}"
