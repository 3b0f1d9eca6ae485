"""Plausibility of the values of channels in their stated units: impossible magnitudes, acceleration in g, static
offsets.

A wrong unit in an import map scales all identified masses, dampings and stiffnesses; an offset violates the linear
model. The limits are chosen by hand, far beyond what haptic devices and common test rigs reach. Called by
`analysis.look.overview`."""

from collections.abc import Sequence

import numpy as np

from analysis.look.channels import Channel, compute_rms
from analysis.look.check import Check, add_fine_if_none
from equalizer.signals.units import UNSTATED

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
"""Standard gravity (m/s²), and the range of a mean reading in m/s² that suggests a value in multiples of gravity."""
LEAST_OFFSET_RATIO = 0.5
"""Least ratio of the mean's magnitude to the rms about it for which an offset is reported."""


def check_units(channels: Sequence[Channel]) -> tuple[Check, ...]:
    """Check the values of each channel against its unit; a check per doubtful channel, or a single "fine" check where
    none is."""
    checks = tuple(check for channel in channels if (check := _check_channel_unit(channel)))
    return add_fine_if_none(UNITS_CHECK, checks, "All amplitudes are plausible in their units.")


def _check_channel_unit(channel: Channel) -> Check | None:
    """Check one channel's unit: unstated, too large, too small, or an acceleration in g; None where it is plausible or
    the channel has no finite sample."""
    finite_samples = channel.finite_samples
    if not finite_samples.size:
        return None
    if channel.unit == UNSTATED and channel.role != "condition":
        return Check(
            UNITS_CHECK,
            "notice",
            f"{channel.label} has no unit: its scale is not known.",
            "State the unit in the map; otherwise masses, damping and stiffnesses are relative to this channel's "
            "scale.",
        )
    peak, rms_value = float(np.max(np.abs(finite_samples))), compute_rms(finite_samples)
    if peak > _LARGEST_PEAKS.get(channel.unit, np.inf):
        return _report_wrong_unit(channel, f"{channel.label} reaches {channel.format(peak)}.")
    if 0 < rms_value < _SMALLEST_RMS.get(channel.unit, 0.0):
        return _report_wrong_unit(channel, f"{channel.label} moves by {channel.format(rms_value)} rms.")
    mean_magnitude = abs(float(finite_samples.mean()))
    if (
        channel.unit == "m/s^2"
        and GRAVITY_MULTIPLE_RANGE[0] < mean_magnitude < GRAVITY_MULTIPLE_RANGE[1]
        and rms_value < mean_magnitude
    ):
        text = (
            f"{channel.label} rests at {channel.format(float(finite_samples.mean()))}, where an accelerometer shows "
            f"{STANDARD_GRAVITY_MPS2:.2f}."
        )
        return Check(
            UNITS_CHECK, "wrong", text, "State the unit g in the map: the numbers look like multiples of gravity."
        )
    return None


def _report_wrong_unit(channel: Channel, text: str) -> Check:
    """Make a check of level "wrong" on the unit. text: the sentence with the reason."""
    return Check(UNITS_CHECK, "wrong", text, f"Check the unit of {channel.label} in the map.")


def check_offsets(channels: Sequence[Channel]) -> tuple[Check, ...]:
    """Check commands and responses for static offsets; positions, velocities and conditions are exempt."""
    checks = tuple(
        check
        for channel in channels
        if channel.role in ("command", "response") and channel.unit not in ("m", "rad", "m/s", "rad/s")
        if (check := _check_channel_offset(channel))
    )
    return add_fine_if_none(OFFSETS_CHECK, checks, "No command, force, acceleration or voltage has a large offset.")


def _check_channel_offset(channel: Channel) -> Check | None:
    """Check the offset of one channel; None where it is below `LEAST_OFFSET_RATIO` times the rms, or the channel is
    constant or has no finite sample."""
    finite_samples = channel.finite_samples
    rms_value = compute_rms(finite_samples)
    if not finite_samples.size or rms_value == 0 or abs(float(finite_samples.mean())) < LEAST_OFFSET_RATIO * rms_value:
        return None
    mean = float(finite_samples.mean())
    text = f"The mean of {channel.label} is {channel.format(mean)} ({abs(mean) / rms_value:.3g} times its rms)."
    if channel.unit == "m/s^2" and abs(abs(mean) / STANDARD_GRAVITY_MPS2 - 1) < 0.03:
        return Check(OFFSETS_CHECK, "fine", f"{text} That is gravity.")
    if channel.role == "command":
        return Check(
            OFFSETS_CHECK,
            "notice",
            text,
            "Linear models contain no offset: state the operating point, or subtract the offset.",
        )
    return Check(
        OFFSETS_CHECK,
        "notice",
        text,
        "Subtract it if it is an offset of the sensor; keep it if it is gravity or a load.",
    )
