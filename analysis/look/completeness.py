"""What is not there, or there twice: missing samples, channels that never change, copies of others."""

from collections.abc import Iterator, Sequence
from itertools import combinations

import numpy as np

from analysis.look.channels import Channel, rms
from analysis.look.check import Check, fine_if_none
from equalizer.signals.signal import FloatArray

MISSING, CONSTANT, COPIES = "missing samples", "constant channels", "copied channels"
_MANY = 0.2
"""Share of missing samples from which a channel is useless to most analyses."""
_SAME_STORED = 1e-6
"""Share of a channel's rms that a copy may differ by: rounding in single precision."""
_FIRST_FEW = 1000
"""Samples that a copy is looked for in first: most channels are none."""


def missing_samples(channels: Sequence[Channel], rate_hz: float) -> tuple[Check, ...]:
    found = tuple(_missing(channel, rate_hz) for channel in channels if not np.isfinite(channel.samples).all())
    return fine_if_none(MISSING, found, "No sample is missing in any channel.")


def _missing(channel: Channel, rate_hz: float) -> Check:
    lost = ~np.isfinite(channel.samples)
    count, first = int(lost.sum()), int(np.argmax(lost))
    longest = _longest_run(np.asarray(lost, dtype=np.float64))
    return Check(
        MISSING,
        "wrong" if count > _MANY * len(lost) else "notice",
        f"{channel.label} misses {count} of {len(lost)} samples, the first at {first / rate_hz:.4g} s; the longest gap "
        f"is {longest} samples.",
        "Cut the gaps out with segments, or record again; analyses that need every sample refuse them by name.",
    )


def _longest_run(marked: FloatArray) -> int:
    edges = np.flatnonzero(np.diff(np.concatenate([[0.0], marked, [0.0]])))
    return int(np.max(edges[1::2] - edges[::2])) if len(edges) else 0


def constant_channels(channels: Sequence[Channel]) -> tuple[Check, ...]:
    """A setting is expected to stay, and so may what was decided beforehand."""
    measured = [channel for channel in channels if channel.role not in ("condition", "excitation")]
    found = tuple(_constant(channel) for channel in measured if channel.known.size and np.ptp(channel.known) == 0)
    return fine_if_none(CONSTANT, found, "Every command and every sensor changes.")


def _constant(channel: Channel) -> Check:
    seen = f"{channel.label} is {channel.of(float(channel.known[0]))} throughout."
    if channel.role == "command":
        return Check(CONSTANT, "notice", seen, "Nothing can be said of what it drives; leave it out, or drive it.")
    return Check(CONSTANT, "wrong", seen, "Check the cable and the map: a sensor that works is never so still.")


def copied_channels(channels: Sequence[Channel]) -> tuple[Check, ...]:
    """Of the same, or of a scaled or shifted channel. An excitation that is its command tells that nothing fed back."""
    found = tuple(_copies(channels))
    return fine_if_none(COPIES, found, "No channel is a copy of another.")


def _copies(channels: Sequence[Channel]) -> Iterator[Check]:
    moving = [channel for channel in channels if channel.known.size and np.ptp(channel.known) > 0]
    for each, other in combinations(moving, 2):
        if {each.role, other.role} == {"command", "excitation"}:
            continue
        factor = _factor(each.samples, other.samples)
        if factor is None:
            continue
        scaled = "" if abs(factor - 1) < _SAME_STORED else f" times {factor:.6g}, up to an offset"
        independent = {each.role, other.role} <= {"command", "response"}
        yield Check(
            COPIES,
            "wrong" if independent else "notice",
            f"{other.label} is {each.label}{scaled}, sample by sample.",
            "Check the map: two sensors never agree to the last digit; leave one of them out.",
        )


def _factor(one: FloatArray, other: FloatArray) -> float | None:
    """Of the second to the first; None where it is no copy."""
    few = slice(None, None, max(1, len(one) // _FIRST_FEW))
    if len(one) > _FIRST_FEW and _copied(one[few], other[few]) is None:
        return None
    return _copied(one, other)


def _copied(one: FloatArray, other: FloatArray) -> float | None:
    known = np.isfinite(one) & np.isfinite(other)
    if known.sum() < 3:
        return None
    first, second = one[known] - one[known].mean(), other[known] - other[known].mean()
    size, energy = rms(second), float(first @ first)
    if energy == 0 or size == 0:
        return None
    factor = float(first @ second) / energy
    return factor if rms(second - factor * first) < _SAME_STORED * size else None
