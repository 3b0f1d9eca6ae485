"""Steps of a converter or an encoder, against what moves."""

from collections.abc import Sequence

from analysis.diagnosis.data.rounding import rounding_step
from analysis.look.channels import Channel, rms
from analysis.look.check import Check

RESOLUTION = "resolution"
COARSE, ROUGH, UNSEEN = 3.0, 30.0, 1000.0
"""Steps in a channel's rms: below the first, rounding hides the motion, below the second it shows beside it, above the
last it is not worth a word."""
_SENSORS = ("response", "position")


def resolution(channels: Sequence[Channel]) -> tuple[Check, ...]:
    """Of sensors; a command may have as few values as it was given."""
    found = [_of_channel(channel) for channel in channels if channel.role in _SENSORS]
    known = tuple(check for check in found if check is not None)
    return known or (Check(RESOLUTION, "fine", "No step of a converter matters in any sensor."),)


def _of_channel(channel: Channel) -> Check | None:
    step = rounding_step(channel.samples)
    steps = rms(channel.known) / step if step else UNSEEN
    if steps >= UNSEEN:
        return None
    seen = f"{channel.label} moves in steps of {channel.of(step)}; its rms is {steps:.3g} of them."
    if steps < COARSE:
        return Check(RESOLUTION, "wrong", seen, "Use a finer sensor or range, or move more: rounding hides the motion.")
    if steps < ROUGH:
        return Check(
            RESOLUTION, "notice", seen, "Do not differentiate it without a filter; expect rounding as a floor."
        )
    return Check(RESOLUTION, "fine", seen)
