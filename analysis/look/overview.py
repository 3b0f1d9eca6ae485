"""Overview of a recording before any model is fitted: its channels, spectra and levels, and all checks of its quality.

The checks find missing samples, constant or copied channels, clock errors, wrong units, inconsistent kinematics,
clipping, coarse quantization, offsets, axes without excitation, low coherence and poor repeatability; each gives a
sentence, and what to do.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from analysis.diagnosis.data.observed_parts import parts_of
from analysis.diagnosis.noise.rounding import rounding_step
from analysis.look.channels import Channel, Stretch, channels_of, rms
from analysis.look.check import Check
from analysis.look.clipping import check_clipping
from analysis.look.clock import CLOCK, check_clock
from analysis.look.completeness import check_constant_channels, check_copied_channels, check_missing_samples
from analysis.look.cross_spectra import CrossSpectra, cross_spectra
from analysis.look.driven_band import (
    DrivenBand,
    ResponseCoherence,
    check_driven_axes,
    coherence_checks,
    find_driven_bands,
    response_coherences,
)
from analysis.look.kinematics import KinematicPair, find_kinematic_pairs, kinematic_checks, lag_checks
from analysis.look.levels import SegmentLevel, level_checks, segment_levels
from analysis.look.plausibility import check_offsets, check_units
from analysis.look.repeats import Repeats, check_repeats, find_repeats
from analysis.wording import replace_time_units
from equalizer.signals.recording import Recording
from equalizer.signals.summary import Summarised, Summary

RESOLUTION = "resolution"
"""Name of the check of quantization."""
HIDDEN_STEPS, ROUGH_STEPS, FINE_STEPS = 3.0, 30.0, 1000.0
"""Limits of a channel's rms over its quantization step. Below the first, the check is "wrong", because quantization
hides the motion; below the second, it is a notice; from the last on, nothing is reported."""
_SENSORS = ("response", "position")
"""Roles of channels that are measured."""


def check_resolution(channels: Sequence[Channel]) -> tuple[Check, ...]:
    """Check the quantization of sensor channels, one check per channel with a step that matters, else a single one.
    Commands are left out: they may have few values by design."""
    candidates = [_resolution_check(channel) for channel in channels if channel.role in _SENSORS]
    checks = tuple(check for check in candidates if check is not None)
    return checks or (Check(RESOLUTION, "fine", "No sensor is limited by the resolution of its converter."),)


def _resolution_check(channel: Channel) -> Check | None:
    """Check of one channel; None where it has no quantization step, or one below a thousandth of its rms."""
    step = rounding_step(channel.samples)
    steps = rms(channel.finite_samples) / step if step else FINE_STEPS
    if steps >= FINE_STEPS:
        return None
    text = f"{channel.label} has a resolution of {channel.format(step)}; its rms is {steps:.3g} of these steps."
    if steps < HIDDEN_STEPS:
        return Check(RESOLUTION, "wrong", text, "Use a finer sensor or range, or move more: rounding hides the motion.")
    if steps < ROUGH_STEPS:
        return Check(
            RESOLUTION,
            "notice",
            text,
            "Do not differentiate it without a filter; expect rounding noise as a lower bound of the error.",
        )
    return Check(RESOLUTION, "fine", text)


@dataclass(frozen=True, slots=True)
class ChannelSummary:
    """Range, mean, rms and number of missing samples of a channel, in its unit."""

    role: str
    name: str
    quantity: str
    unit: str
    lowest: float
    highest: float
    mean: float
    rms: float
    """Rms about the mean."""
    missing: int
    """Number of samples without a value."""


@dataclass(frozen=True, repr=False, slots=True, eq=False)
class Overview(Summarised):
    """Results of a recording that need no model: spectra, levels, repeats, consistency and checks."""

    name: str
    recording: Recording
    channels: tuple[Channel, ...]
    stretches: tuple[Stretch, ...]
    summaries: tuple[ChannelSummary, ...]
    levels: tuple[SegmentLevel, ...]
    spectra: CrossSpectra | None
    """Cross spectra of all channels; None where no stretch without gaps is long enough."""
    bands: tuple[DrivenBand, ...]
    coherences: tuple[ResponseCoherence, ...]
    pairs: tuple[KinematicPair, ...]
    repeats: Repeats
    checks: tuple[Check, ...]
    """All checks, sorted by level: "wrong", then "notice", then "fine"."""

    def summary(self) -> Summary:
        """Range and rms of each channel, and all checks that are not fine."""
        noticed = [check for check in self.checks if check.level != "fine"]
        return Summary(
            f"{self.name}: {len(self.channels)} channels",
            (
                *(
                    (
                        f"{row.role} {row.name}",
                        f"{row.lowest:.4g} to {row.highest:.4g} {row.unit}, rms {row.rms:.3g}",
                    )
                    for row in self.summaries
                ),
                *((check.level, check.seen) for check in noticed),
            ),
        )


def overview(name: str, recording: Recording) -> Overview:
    """Channels, spectra, levels and checks of a recording. name: name of the file, for tables and figures."""
    channels, stretches, rate_hz = channels_of(recording), parts_of(recording), recording.sample_rate_hz
    spectra = cross_spectra(channels, stretches, rate_hz)
    bands = find_driven_bands(spectra, channels) if spectra else ()
    coherences = response_coherences(spectra, channels, bands) if spectra else ()
    pairs = find_kinematic_pairs(channels, stretches, rate_hz)
    levels = segment_levels(recording, channels)
    repeats = find_repeats(recording, stretches)
    checks = (
        *check_missing_samples(channels, rate_hz),
        *check_constant_channels(channels),
        *check_copied_channels(channels),
        *check_clock(recording, stretches),
        *check_units(channels),
        *kinematic_checks(pairs, rate_hz),
        *(lag_checks(channels, spectra, rate_hz) if spectra else ()),
        *check_clipping(channels),
        *check_resolution(channels),
        *check_offsets(channels),
        *check_driven_axes(recording, bands),
        *coherence_checks(coherences, recording),
        *level_checks(levels, channels),
        *check_repeats(recording, repeats),
    )
    return Overview(
        name=name,
        recording=recording,
        channels=channels,
        stretches=stretches,
        summaries=tuple(_summarise_channel(channel) for channel in channels),
        levels=levels,
        spectra=spectra,
        bands=bands,
        coherences=coherences,
        pairs=pairs,
        repeats=repeats,
        checks=_worst_first(checks if recording.is_timed else tuple(map(_count_in_samples, checks))),
    )


def _worst_first(checks: tuple[Check, ...]) -> tuple[Check, ...]:
    """The checks sorted by level; those of one level keep their order."""
    severity = ("wrong", "notice", "fine")
    return tuple(sorted(checks, key=lambda check: severity.index(check.level)))


def _count_in_samples(check: Check) -> Check:
    """The check with times given in samples, for a recording whose sample rate is not known; the check of the clock is
    unchanged."""
    if check.name == CLOCK:
        return check
    return replace(check, seen=replace_time_units(check.seen), do=replace_time_units(check.do))


def _summarise_channel(channel: Channel) -> ChannelSummary:
    """Summary of the known samples; NaN where there are none."""
    finite = channel.finite_samples if channel.finite_samples.size else np.array([np.nan])
    return ChannelSummary(
        channel.role,
        channel.name,
        channel.quantity,
        channel.unit,
        float(finite.min()),
        float(finite.max()),
        float(finite.mean()),
        rms(channel.finite_samples),
        len(channel.samples) - channel.finite_samples.size,
    )
