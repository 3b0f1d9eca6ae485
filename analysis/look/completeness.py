"""Checks of completeness: missing samples, constant channels, copies of other channels.

A constant sensor or two identical sensors usually mean an unplugged cable or a wrong channel map. A channel is a copy
of another where it equals that channel, scaled and shifted (least squares), to the rounding of single precision.
"""

from collections.abc import Iterator, Sequence
from itertools import combinations

import numpy as np

from analysis.look.channels import Channel, rms
from analysis.look.check import Check, add_fine_if_none
from equalizer.signals.signal import FloatArray, runs_of

MISSING, CONSTANT, COPIES = "missing samples", "constant channels", "copied channels"
_USELESS_SHARE = 0.2
"""Share of missing samples above which a channel is useless to most analyses."""
_SAME_STORED = 1e-6
"""Largest rms difference between a channel and its copy, relative to the rms: rounding in single precision."""
_FIRST_FEW = 1000
"""Number of samples that are compared first, to save time: most pairs of channels differ there already."""


def check_missing_samples(channels: Sequence[Channel], rate_hz: float) -> tuple[Check, ...]:
    """A check of each channel with missing samples; a single "fine" check where no channel has any."""
    checks = tuple(_check_missing(channel, rate_hz) for channel in channels if not np.isfinite(channel.samples).all())
    return add_fine_if_none(MISSING, checks, "No sample is missing in any channel.")


def _check_missing(channel: Channel, rate_hz: float) -> Check:
    """The check of a channel with at least one missing sample: "wrong" above the share `_USELESS_SHARE`."""
    is_missing = ~np.isfinite(channel.samples)
    count, first = int(is_missing.sum()), int(np.argmax(is_missing))
    longest = max(stop - start for start, stop in runs_of(is_missing))
    return Check(
        MISSING,
        "wrong" if count > _USELESS_SHARE * len(is_missing) else "notice",
        f"{channel.label} lacks {count} of {len(is_missing)} samples, the first at {first / rate_hz:.4g} s; the "
        f"longest gap is {longest} samples.",
        "Cut the gaps out with segments, or record again; analyses that need every sample refuse them by name.",
    )


def check_constant_channels(channels: Sequence[Channel]) -> tuple[Check, ...]:
    """A check of each constant command or sensor; a single "fine" check where all change. Conditions and excitations
    are left out: they may be constant."""
    measured = [channel for channel in channels if channel.role not in ("condition", "excitation")]
    checks = tuple(
        _constant_check(channel)
        for channel in measured
        if channel.finite_samples.size and np.ptp(channel.finite_samples) == 0
    )
    return add_fine_if_none(CONSTANT, checks, "Every command and every sensor changes.")


def _constant_check(channel: Channel) -> Check:
    """The check of a constant channel: a notice for a command, "wrong" for a sensor."""
    text = f"{channel.label} is {channel.format(float(channel.finite_samples[0]))} throughout."
    if channel.role == "command":
        return Check(CONSTANT, "notice", text, "Its effect cannot be determined; leave it out, or record it driven.")
    return Check(CONSTANT, "wrong", text, "Check the cable and the map: a working sensor is never exactly constant.")


def check_copied_channels(channels: Sequence[Channel]) -> tuple[Check, ...]:
    """A check of each channel that is a copy of another, also scaled or shifted; a single "fine" check without copies.
    An excitation may equal its command: without feedback they are the same signal."""
    checks = tuple(_copy_checks(channels))
    return add_fine_if_none(COPIES, checks, "No channel is a copy of another.")


def _copy_checks(channels: Sequence[Channel]) -> Iterator[Check]:
    """Compare each pair of channels that change; "wrong" where both are commands or responses, else a notice."""
    changing = [channel for channel in channels if channel.finite_samples.size and np.ptp(channel.finite_samples) > 0]
    for first, second in combinations(changing, 2):
        if {first.role, second.role} == {"command", "excitation"}:
            continue
        factor = _find_copy_factor(first.samples, second.samples)
        if factor is None:
            continue
        scaled = "" if abs(factor - 1) < _SAME_STORED else f" times {factor:.6g}, up to an offset"
        independent = {first.role, second.role} <= {"command", "response"}
        yield Check(
            COPIES,
            "wrong" if independent else "notice",
            f"{second.label} is {first.label}{scaled}, sample by sample.",
            "Check the map: two sensors never agree to the last digit; leave one of them out.",
        )


def _find_copy_factor(first: FloatArray, second: FloatArray) -> float | None:
    """Factor from the first channel to the second; None where the second is no copy. Both: (n,)."""
    subset = slice(None, None, max(1, len(first) // _FIRST_FEW))
    if len(first) > _FIRST_FEW and _copy_factor(first[subset], second[subset]) is None:
        return None
    return _copy_factor(first, second)


def _copy_factor(values: FloatArray, copy: FloatArray) -> float | None:
    """Least-squares factor between both channels about their means; None where the residual exceeds rounding."""
    is_finite = np.isfinite(values) & np.isfinite(copy)
    if is_finite.sum() < 3:
        return None
    first, second = values[is_finite] - values[is_finite].mean(), copy[is_finite] - copy[is_finite].mean()
    size, energy = rms(second), float(first @ first)
    if energy == 0 or size == 0:
        return None
    factor = float(first @ second) / energy
    return factor if rms(second - factor * first) < _SAME_STORED * size else None
