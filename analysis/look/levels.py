"""Rms level of commands and responses in each segment, and a check of their proportionality.

In a linear device the response grows in proportion to the command. A gain that differs between the weakest and the
strongest segment indicates a nonlinearity (friction, end stops, hardening, saturation), or noise.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from analysis.look.channels import Channel, rms
from analysis.look.check import Check
from analysis.wording import typeset
from equalizer.signals.recording import Recording, Segment

LEVELS = "levels"
_LEAST_LEVEL_RATIO = 1.5
"""Least ratio of the strongest to the weakest command for which gains are compared."""
NOTABLE_CHANGE, LARGE_CHANGE = 0.05, 0.3
"""Relative change of the gain (rms of response over rms of command) above which it is reported, and called large."""


@dataclass(frozen=True, slots=True)
class SegmentLevel:
    """A segment with its start and duration (s) and the rms of every channel in it."""

    number: int
    """Number of the segment from 1; 0 for a recording without segments."""
    kind: str
    role: str
    start_s: float
    duration_s: float
    period: int
    """Samples per period; 0 = not periodic."""
    rms: tuple[float, ...]
    """Rms about the mean of each channel, in the channel's unit."""


def segment_levels(recording: Recording, channels: Sequence[Channel]) -> tuple[SegmentLevel, ...]:
    """Levels of all segments, or of the whole recording where it has no segments."""
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
            tuple(rms(_finite_samples(channel, segment)) for channel in channels),
        )
        for number, segment in enumerate(recording.segments or full_record, start=1)
    )


def _finite_samples(channel: Channel, segment: Segment) -> np.ndarray:
    """Finite samples of the channel in the segment."""
    segment_samples = channel.samples[segment.start : segment.stop]
    return np.asarray(segment_samples[np.isfinite(segment_samples)])


def level_checks(levels: Sequence[SegmentLevel], channels: Sequence[Channel]) -> tuple[Check, ...]:
    """Check the proportionality of each response over segments of the most frequent kind, for each set of active
    commands. Empty where commands differ in unit, or no segment is excited."""
    commands = [k for k, channel in enumerate(channels) if channel.role == "command"]
    kinds = [level.kind for level in levels if level.kind not in ("rest", "free")]
    if not kinds or len({channels[k].unit for k in commands}) > 1:
        return ()
    main_kind = max(set(kinds), key=kinds.count)
    rows = [(_command_level(level, commands), level) for level in levels if level.kind == main_kind]
    # Different axes may have different gains: only segments that drive the same axes are compared.
    groups = {_active_commands(level, commands) for _, level in rows}
    checks = []
    for group in groups:
        comparable = [(size, level) for size, level in rows if _active_commands(level, commands) == group and size > 0]
        if len(comparable) > 1 and max(s for s, _ in comparable) > _LEAST_LEVEL_RATIO * min(s for s, _ in comparable):
            checks += [_proportion_check(comparable, k, c) for k, c in enumerate(channels) if c.role == "response"]
    return tuple(check for check in checks if check is not None)


def _command_level(level: SegmentLevel, commands: Sequence[int]) -> float:
    """Root of the sum of squares of the commands' rms."""
    return float(np.hypot.reduce([level.rms[k] for k in commands]))


def _active_commands(level: SegmentLevel, commands: Sequence[int]) -> tuple[bool, ...]:
    """Whether each command exceeds a tenth of the strongest in this segment."""
    strongest = max(level.rms[k] for k in commands)
    return tuple(level.rms[k] > 0.1 * strongest for k in commands)


def _proportion_check(
    comparable: Sequence[tuple[float, SegmentLevel]], response: int, channel: Channel
) -> Check | None:
    """Compare the gains of one response in the weakest and the strongest segment; None where it does not move.

    comparable: (rms of the command, segment) of comparable segments. response: index of the channel.
    """
    ordered = sorted(comparable, key=lambda row: row[0])
    weakest, strongest = ordered[0], ordered[-1]
    if weakest[1].rms[response] == 0 or strongest[1].rms[response] == 0:
        return None
    gains = [level.rms[response] / size for size, level in (weakest, strongest)]
    change = gains[1] / gains[0] - 1
    text = (
        f"From the weakest to the strongest {weakest[1].kind} ({strongest[0] / weakest[0]:.3g} times) the rms of "
        f"{channel.label} over that of the command changes by {typeset(f'{100 * change:+.3g}')} %."
    )
    if abs(change) < NOTABLE_CHANGE:
        return Check(LEVELS, "fine", text)
    large = abs(change) > LARGE_CHANGE
    advice = "The device is far from linear: friction, stops, hardening or saturation." if large else ""
    return Check(LEVELS, "notice", text, advice or "The device is slightly nonlinear, or noise contributes to the rms.")
