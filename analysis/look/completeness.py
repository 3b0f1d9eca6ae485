"""Checks of a recording for missing samples, constant channels and copies of other channels.

A constant sensor or two identical sensors usually mean an unplugged cable or a wrong channel map. A channel is a copy
of another if it equals that channel, scaled and shifted (least squares), within the rounding of single precision.
"""

from collections.abc import Iterator, Sequence
from itertools import combinations

import numpy as np

from analysis.look.channels import Channel, compute_rms, is_driven
from analysis.look.check import FREE_ADVICE, UNDRIVEN_ADVICE, Check, add_fine_if_none
from equalizer.signals.signal import FloatArray, find_runs

MISSING_CHECK, CONSTANT_CHECK, COPIES_CHECK = "missing samples", "constant channels", "copied channels"
_WRONG_MISSING_SHARE = 0.2
"""Share of missing samples above which the check is "wrong" instead of a notice: most analyses cannot use the channel.
Chosen by hand."""
_COPY_TOLERANCE = 1e-6
"""Largest rms difference between a channel and its copy, relative to the rms of the copy: rounding in single
precision."""
_SUBSET_SIZE = 1000
"""Least number of samples, evenly spaced, that are compared first to save time: most pairs differ in these. Chosen."""


def check_missing_samples(channels: Sequence[Channel], rate_hz: float) -> tuple[Check, ...]:
    """Check all channels for missing samples: one check per channel that has any, or a single "fine" check."""
    checks = tuple(
        _report_missing_samples(channel, rate_hz) for channel in channels if not np.isfinite(channel.samples).all()
    )
    return add_fine_if_none(MISSING_CHECK, checks, "No sample is missing in any channel.")


def _report_missing_samples(channel: Channel, rate_hz: float) -> Check:
    """Report the missing samples of a channel, at least one: "wrong" above `_WRONG_MISSING_SHARE`, else a notice."""
    is_missing = ~np.isfinite(channel.samples)
    count, first_gap = int(is_missing.sum()), int(np.argmax(is_missing))
    longest_gap = max(stop - start for start, stop in find_runs(is_missing))
    return Check(
        MISSING_CHECK,
        "wrong" if count > _WRONG_MISSING_SHARE * len(is_missing) else "notice",
        f"{channel.label} lacks {count} of {len(is_missing)} samples, the first at {first_gap / rate_hz:.4g} s; the "
        f"longest gap is {longest_gap} samples.",
        "Cut the gaps out with segments, or record again; analyses that need every sample refuse them by name.",
    )


def check_constant_channels(channels: Sequence[Channel]) -> tuple[Check, ...]:
    """Check commands and sensors for constant values: one check per constant channel, or a single "fine" check.
    Conditions and excitations are left out: they may be constant."""
    constant = [
        channel
        for channel in channels
        if channel.role not in ("condition", "excitation") and channel.finite_samples.size and not channel.is_varying
    ]
    advice = UNDRIVEN_ADVICE if is_driven(channels) else FREE_ADVICE
    checks = tuple(_report_constant_channel(channel, advice) for channel in constant)
    return add_fine_if_none(CONSTANT_CHECK, checks, "Every command and every sensor changes.")


def _report_constant_channel(channel: Channel, command_advice: str) -> Check:
    """Report a constant channel: a notice for a command, with its advice, "wrong" for a sensor."""
    text = f"{channel.label} is {channel.format(float(channel.finite_samples[0]))} throughout."
    if channel.role == "command":
        return Check(CONSTANT_CHECK, "notice", text, command_advice)
    return Check(
        CONSTANT_CHECK, "wrong", text, "Check the cable and the map: a working sensor is never exactly constant."
    )


def check_copied_channels(channels: Sequence[Channel]) -> tuple[Check, ...]:
    """Check for channels that are copies of others, possibly scaled and shifted: one check per pair, or a single "fine"
    check. An excitation may equal its command: without feedback they are the same signal."""
    checks = tuple(_compare_pairs(channels))
    return add_fine_if_none(COPIES_CHECK, checks, "No channel is a copy of another.")


def _compare_pairs(channels: Sequence[Channel]) -> Iterator[Check]:
    """Report each pair of varying channels that are copies: "wrong" if each is a command or a response, else a
    notice."""
    changing = [channel for channel in channels if channel.finite_samples.size and np.ptp(channel.finite_samples) > 0]
    for first, second in combinations(changing, 2):
        if {first.role, second.role} == {"command", "excitation"}:
            continue
        scale = _match_channels(first.samples, second.samples)
        if scale is None:
            continue
        scale_text = "" if abs(scale - 1) < _COPY_TOLERANCE else f" times {scale:.6g}"
        is_suspicious = {first.role, second.role} <= {"command", "response"}
        yield Check(
            COPIES_CHECK,
            "wrong" if is_suspicious else "notice",
            f"{second.label} is {first.label}{scale_text}, up to an offset, sample by sample.",
            "Check the map: two sensors never agree to the last digit; leave one of them out.",
        )


def _match_channels(first: FloatArray, second: FloatArray) -> float | None:
    """Compute the scale factor from the first channel to the second, both (n,); None if the second is not a copy."""
    subset = slice(None, None, max(1, len(first) // _SUBSET_SIZE))
    if len(first) > _SUBSET_SIZE and _fit_scale(first[subset], second[subset]) is None:
        return None
    return _fit_scale(first, second)


def _fit_scale(values: FloatArray, copy: FloatArray) -> float | None:
    """Fit the least-squares scale factor from `values` to `copy`, both (n,), about their means; None if the residual is
    at least `_COPY_TOLERANCE`, a channel is constant, or fewer than three samples are finite in both."""
    is_finite = np.isfinite(values) & np.isfinite(copy)
    if is_finite.sum() < 3:
        return None
    centred_values, centred_copy = (
        values[is_finite] - values[is_finite].mean(),
        copy[is_finite] - copy[is_finite].mean(),
    )
    copy_rms, energy = compute_rms(centred_copy), float(centred_values @ centred_values)
    if energy == 0 or copy_rms == 0:
        return None
    scale = float(centred_values @ centred_copy) / energy
    return scale if compute_rms(centred_copy - scale * centred_values) < _COPY_TOLERANCE * copy_rms else None
