"""Checks of completeness: missing samples, constant channels, copies of other channels."""

from collections.abc import Iterator, Sequence
from itertools import combinations

import numpy as np

from analysis.look.channels import Channel, rms
from analysis.look.check import Check, fine_if_none
from equalizer.signals.signal import FloatArray, runs_of

MISSING, CONSTANT, COPIES = "missing samples", "constant channels", "copied channels"
_MANY = 0.2
"""Share of missing samples from which a channel is useless to most analyses."""
_SAME_STORED = 1e-6
"""Share of a channel's rms that a copy may differ by: rounding in single precision."""
_FIRST_FEW = 1000
"""Samples in which a copy is searched for first, because most channels are none."""


def check_missing_samples(channels: Sequence[Channel], rate_hz: float) -> tuple[Check, ...]:
    """A check of each channel with missing samples; a single "fine" check where no channel has any."""
    found = tuple(_check_missing(channel, rate_hz) for channel in channels if not np.isfinite(channel.samples).all())
    return fine_if_none(MISSING, found, "No sample is missing in any channel.")


def _check_missing(channel: Channel, rate_hz: float) -> Check:
    lost = ~np.isfinite(channel.samples)
    count, first = int(lost.sum()), int(np.argmax(lost))
    longest = max(stop - start for start, stop in runs_of(lost))
    return Check(
        MISSING,
        "wrong" if count > _MANY * len(lost) else "notice",
        f"{channel.label} misses {count} of {len(lost)} samples, the first at {first / rate_hz:.4g} s; the longest gap "
        f"is {longest} samples.",
        "Cut the gaps out with segments, or record again; analyses that need every sample refuse them by name.",
    )


def check_constant_channels(channels: Sequence[Channel]) -> tuple[Check, ...]:
    """Check commands and sensors for constant channels; a condition or an excitation may be constant."""
    measured = [channel for channel in channels if channel.role not in ("condition", "excitation")]
    found = tuple(_constant_check(channel) for channel in measured if channel.known.size and np.ptp(channel.known) == 0)
    return fine_if_none(CONSTANT, found, "Every command and every sensor changes.")


def _constant_check(channel: Channel) -> Check:
    text = f"{channel.label} is {channel.format(float(channel.known[0]))} throughout."
    if channel.role == "command":
        return Check(CONSTANT, "notice", text, "Nothing can be said of what it drives; leave it out, or drive it.")
    return Check(CONSTANT, "wrong", text, "Check the cable and the map: a sensor that works is never so still.")


def check_copied_channels(channels: Sequence[Channel]) -> tuple[Check, ...]:
    """Check for copies, also scaled or shifted ones. An excitation that equals its command is not a copy: nothing was
    fed back."""
    found = tuple(_copy_checks(channels))
    return fine_if_none(COPIES, found, "No channel is a copy of another.")


def _copy_checks(channels: Sequence[Channel]) -> Iterator[Check]:
    moving = [channel for channel in channels if channel.known.size and np.ptp(channel.known) > 0]
    for each, other in combinations(moving, 2):
        if {each.role, other.role} == {"command", "excitation"}:
            continue
        factor = _find_copy_factor(each.samples, other.samples)
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


def _find_copy_factor(first: FloatArray, second: FloatArray) -> float | None:
    """Factor of the second channel to the first; None where it is not a copy."""
    few = slice(None, None, max(1, len(first) // _FIRST_FEW))
    if len(first) > _FIRST_FEW and _copy_factor(first[few], second[few]) is None:
        return None
    return _copy_factor(first, second)


def _copy_factor(values: FloatArray, copy: FloatArray) -> float | None:
    known = np.isfinite(values) & np.isfinite(copy)
    if known.sum() < 3:
        return None
    first, second = values[known] - values[known].mean(), copy[known] - copy[known].mean()
    size, energy = rms(second), float(first @ first)
    if energy == 0 or size == 0:
        return None
    factor = float(first @ second) / energy
    return factor if rms(second - factor * first) < _SAME_STORED * size else None
