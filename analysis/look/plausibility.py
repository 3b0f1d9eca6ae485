"""Plausibility of the values of channels in their stated units: impossible magnitudes, acceleration in g, static
offsets.

A wrong unit in an import map scales all identified masses, dampings and stiffnesses; an offset violates the linear
model. All limits were chosen by hand, those of magnitudes far beyond haptic devices and common test rigs.
"""

from collections.abc import Sequence

import numpy as np

from analysis.look.channels import Channel, compute_rms
from analysis.look.check import Check, add_fine_if_none
from equalizer.signals.units import NO_UNIT

UNITS_CHECK, OFFSETS_CHECK = "units", "static offset"
_LARGEST_PEAKS = {
    "N": 1e7, "N m": 1e7, "m": 1e3, "m/s": 1e3, "m/s^2": 1e5, "rad/s": 1e5, "rad/s^2": 1e8, "V": 1e4, "A": 1e4,
    "K": 2e3, "Pa": 1e10,
}  # fmt: skip
"""Peak magnitude, by unit, above which the unit is doubted."""
_SMALLEST_RMS = {
    "N": 1e-7, "N m": 1e-9, "m": 1e-9, "m/s": 1e-8, "m/s^2": 1e-5, "rad": 1e-8, "rad/s": 1e-7, "V": 1e-8, "A": 1e-8,
}  # fmt: skip
"""Rms about the mean, by unit, below which the unit is doubted."""
STANDARD_GRAVITY_MPS2, GRAVITY_MULTIPLE_RANGE = 9.80665, (0.97, 1.03)
"""Standard gravity (m/s²), and the open range of the magnitude of a mean reading that indicates the unit g instead of
the stated m/s²."""
LEAST_OFFSET_RATIO = 0.5
"""Least ratio of the mean's magnitude to the rms about the mean for which an offset is reported."""


def check_units(channels: Sequence[Channel]) -> tuple[Check, ...]:
    """Check the values of each channel against its unit; one check per doubtful channel, or a single "fine" check where
    none is doubtful."""
    checks = tuple(check for channel in channels if (check := _check_channel_unit(channel)))
    return add_fine_if_none(UNITS_CHECK, checks, "All amplitudes are plausible in their units.")


def _check_channel_unit(channel: Channel) -> Check | None:
    """Check one channel's unit: unstated, too large, too small, or an acceleration in g; None where it is plausible or
    the channel has no finite sample."""
    finite_samples = channel.finite_samples
    if not finite_samples.size:
        return None
    if channel.unit == NO_UNIT and channel.role != "condition":
        return Check(
            UNITS_CHECK,
            "notice",
            f"{channel.label} has no unit: its scale is not known.",
            "State the unit in the map; otherwise masses, damping and stiffnesses are relative to this channel's "
            "scale.",
        )
    peak, rms = float(np.max(np.abs(finite_samples))), compute_rms(finite_samples)
    if peak > _LARGEST_PEAKS.get(channel.unit, np.inf):
        return _report_wrong_unit(channel, f"{channel.label} reaches {channel.format(peak)}.")
    if 0 < rms < _SMALLEST_RMS.get(channel.unit, 0.0):
        return _report_wrong_unit(channel, f"{channel.label} moves by {channel.format(rms)} rms.")
    mean_magnitude = abs(float(finite_samples.mean()))
    if (
        channel.unit == "m/s^2"
        and GRAVITY_MULTIPLE_RANGE[0] < mean_magnitude < GRAVITY_MULTIPLE_RANGE[1]
        and rms < mean_magnitude
    ):
        finding = (
            f"{channel.label} rests at {channel.format(float(finite_samples.mean()))}, where an accelerometer shows "
            f"{STANDARD_GRAVITY_MPS2:.2f}."
        )
        return Check(
            UNITS_CHECK, "wrong", finding, "State the unit g in the map: the numbers look like multiples of gravity."
        )
    return None


def _report_wrong_unit(channel: Channel, finding: str) -> Check:
    """Make a check of level "wrong" on the unit."""
    return Check(UNITS_CHECK, "wrong", finding, f"Check the unit of {channel.label} in the map.")


def check_offsets(channels: Sequence[Channel]) -> tuple[Check, ...]:
    """Check commands and responses for static offsets, except those in m, rad, m/s or rad/s; one check per channel with
    an offset, or a single "fine" check."""
    checks = tuple(
        check
        for channel in channels
        if channel.role in ("command", "response") and channel.unit not in ("m", "rad", "m/s", "rad/s")
        if (check := _check_channel_offset(channel))
    )
    return add_fine_if_none(OFFSETS_CHECK, checks, "No command, force, acceleration or voltage has a large offset.")


def _check_channel_offset(channel: Channel) -> Check | None:
    """Check the offset of one channel: "fine" where it is standard gravity within 3 % (as `GRAVITY_MULTIPLE_RANGE`),
    else a "notice". None where the mean is below `LEAST_OFFSET_RATIO` times the rms, or the channel is constant or has
    no finite sample."""
    finite_samples = channel.finite_samples
    rms = compute_rms(finite_samples)
    if not finite_samples.size or rms == 0 or abs(float(finite_samples.mean())) < LEAST_OFFSET_RATIO * rms:
        return None
    mean = float(finite_samples.mean())
    finding = f"The mean of {channel.label} is {channel.format(mean)} ({abs(mean) / rms:.3g} times its rms)."
    if channel.unit == "m/s^2" and abs(abs(mean) / STANDARD_GRAVITY_MPS2 - 1) < 0.03:
        return Check(OFFSETS_CHECK, "fine", f"{finding} That is gravity.")
    if channel.role == "command":
        return Check(
            OFFSETS_CHECK,
            "notice",
            finding,
            "Linear models contain no offset: state the operating point, or subtract the offset.",
        )
    return Check(
        OFFSETS_CHECK,
        "notice",
        finding,
        "Subtract it if it is an offset of the sensor; keep it if it is gravity or a load.",
    )
