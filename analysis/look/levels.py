"""Rms level of commands and responses in each segment, and a check of their proportionality (linearity).

In a linear device the response grows in proportion to the command. A gain (rms of the response over rms of the command)
that differs between the weakest and the strongest segment indicates a nonlinearity (friction, end stops, hardening,
saturation), or noise.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from analysis.look.channels import Channel, compute_rms
from analysis.look.check import Check
from analysis.wording import typeset
from equalizer.signals.recording import Recording, Segment

LEVELS = "levels"
_LEAST_LEVEL_RATIO = 1.5
"""Ratio of the strongest to the weakest command above which gains are compared. Chosen."""
NOTABLE_GAIN_CHANGE, LARGE_GAIN_CHANGE = 0.05, 0.3
"""Relative changes of the gain from the weakest to the strongest segment, from which it is noted, and above which it is
called large. Chosen."""


@dataclass(frozen=True, slots=True)
class SegmentLevel:
    """A segment of a recording with the rms of every channel in it."""

    number: int
    """Number of the segment from 1; 0 for a recording without segments."""
    kind: str
    """Kind of excitation (`Segment.kind`)."""
    role: str
    start_s: float
    """Start from the first sample of the recording (s)."""
    duration_s: float
    period: int
    """Samples per period; 0 = not periodic."""
    rms: tuple[float, ...]
    """Rms about the mean of each channel over its finite samples, in the channel's unit."""


def compute_segment_levels(recording: Recording, channels: Sequence[Channel]) -> tuple[SegmentLevel, ...]:
    """Compute the levels of all segments, or of the full recording, kind "unmarked", where it has no segments."""
    full_record = (Segment(0, len(recording), "unmarked"),)
    rate_hz = recording.sample_rate_hz
    return tuple(
        SegmentLevel(
            number if recording.segments else 0,
            segment.kind,
            segment.role,
            segment.start / rate_hz,
            (segment.stop - segment.start) / rate_hz,
            segment.period,
            tuple(compute_rms(_select_finite_samples(channel, segment)) for channel in channels),
        )
        for number, segment in enumerate(recording.segments or full_record, start=1)
    )


def _select_finite_samples(channel: Channel, segment: Segment) -> np.ndarray:
    """Select the finite samples (n,) of the channel in the segment."""
    segment_samples = channel.samples[segment.start : segment.stop]
    return np.asarray(segment_samples[np.isfinite(segment_samples)])


def check_proportionality(levels: Sequence[SegmentLevel], channels: Sequence[Channel]) -> tuple[Check, ...]:
    """Check the proportionality of each response over the excited segments of the most frequent kind, for each set of
    driven commands. Empty where commands differ in unit, no segment is excited (all are rest or free), or levels are
    too similar (`_LEAST_LEVEL_RATIO`)."""
    command_indices = [index for index, channel in enumerate(channels) if channel.role == "command"]
    excited_kinds = [level.kind for level in levels if level.kind not in ("rest", "free")]
    if not excited_kinds or len({channels[index].unit for index in command_indices}) > 1:
        return ()
    main_kind = max(dict.fromkeys(excited_kinds), key=excited_kinds.count)  # the first of equally frequent ones
    command_levels = [
        (_compute_command_rms(level, command_indices), level) for level in levels if level.kind == main_kind
    ]
    # Different axes may have different gains: only segments that drive the same axes are compared.
    active_sets = dict.fromkeys(_find_active_commands(level, command_indices) for _, level in command_levels)
    checks = []
    for active_set in active_sets:
        comparable_levels = [
            (command_rms, level)
            for command_rms, level in command_levels
            if _find_active_commands(level, command_indices) == active_set and command_rms > 0
        ]
        if len(comparable_levels) > 1 and max(
            level_rms for level_rms, _ in comparable_levels
        ) > _LEAST_LEVEL_RATIO * min(level_rms for level_rms, _ in comparable_levels):
            checks += [
                _compare_response_gains(comparable_levels, index, response_channel)
                for index, response_channel in enumerate(channels)
                if response_channel.role == "response"
            ]
    return tuple(check for check in checks if check is not None)


def _compute_command_rms(level: SegmentLevel, command_indices: Sequence[int]) -> float:
    """Compute the root of the sum of squares of the rms of all commands, in their common unit."""
    return float(np.hypot.reduce([level.rms[index] for index in command_indices]))


def _find_active_commands(level: SegmentLevel, command_indices: Sequence[int]) -> tuple[bool, ...]:
    """Find the driven commands: True where the rms exceeds a tenth (chosen) of the largest in this segment."""
    strongest_rms = max(level.rms[index] for index in command_indices)
    return tuple(level.rms[index] > 0.1 * strongest_rms for index in command_indices)


def _compare_response_gains(
    comparable_levels: Sequence[tuple[float, SegmentLevel]], response_index: int, channel: Channel
) -> Check | None:
    """Compare the gains of one response in the weakest and the strongest segment; None where its rms is 0 in one of
    them. comparable_levels: at least two pairs (rms of the commands, level). response_index: index of `channel`."""
    ordered_levels = sorted(comparable_levels, key=lambda pair: pair[0])
    weakest, strongest = ordered_levels[0], ordered_levels[-1]
    if weakest[1].rms[response_index] == 0 or strongest[1].rms[response_index] == 0:
        return None
    gains = [level.rms[response_index] / command_rms for command_rms, level in (weakest, strongest)]
    gain_change = gains[1] / gains[0] - 1
    sentence = (
        f"From the weakest to the strongest {weakest[1].kind} ({strongest[0] / weakest[0]:.3g} times) the rms of "
        f"{channel.label} over that of the command changes by {typeset(f'{100 * gain_change:+.3g}')} %."
    )
    if abs(gain_change) < NOTABLE_GAIN_CHANGE:
        return Check(LEVELS, "fine", sentence)
    is_large = abs(gain_change) > LARGE_GAIN_CHANGE
    advice = "The device is far from linear: friction, stops, hardening or saturation." if is_large else ""
    return Check(
        LEVELS, "notice", sentence, advice or "The device is slightly nonlinear, or noise contributes to the rms."
    )
