"""Overview of a recording before any model is fitted: its channels, spectra and levels, and all checks of its quality.

The checks find missing samples, constant or copied channels, clock errors, wrong units, inconsistent kinematics, lags
between channels, clipping, coarse quantization, offsets, axes without excitation, low coherence, levels out of
proportion and poor repeatability; each gives a sentence, and advice where needed. Begin at `make_overview`, exported as
`analysis.overview`.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from analysis.diagnosis.noise.rounding import find_rounding_step
from analysis.look.channels import Channel, Stretch, compute_rms, list_channels
from analysis.look.check import Check
from analysis.look.clipping import check_clipping
from analysis.look.clock import CLOCK, check_clock
from analysis.look.completeness import check_constant_channels, check_copied_channels, check_missing_samples
from analysis.look.cross_spectra import CrossSpectra, estimate_cross_spectra
from analysis.look.driven_band import (
    DrivenBand,
    ResponseCoherence,
    check_coherences,
    check_driven_axes,
    estimate_coherences,
    find_driven_bands,
)
from analysis.look.kinematics import KinematicPair, check_kinematics, check_lags, find_kinematic_pairs
from analysis.look.levels import SegmentLevel, check_proportionality, compute_segment_levels
from analysis.look.plausibility import check_offsets, check_units
from analysis.look.repeats import Repeats, check_repeats, find_repeats
from analysis.wording import replace_time_units
from equalizer.signals.recording import Recording, find_parts
from equalizer.signals.recording_checks import find_length_problems, find_segment_problems
from equalizer.signals.summary import Summary, SummaryDisplay

RESOLUTION = "resolution"
HIDDEN_STEPS, ROUGH_STEPS, FINE_STEPS = 3.0, 30.0, 1000.0
"""Limits of a channel's rms over its quantization step. Below the first, the check is "wrong"; below the second, it is
a notice; from the last on, the channel is not reported. Chosen: the quantization noise of a step q has the rms
q / sqrt(12), that is 10 %, 1 % and 0.03 % of the signal's rms at these limits."""
_SENSOR_ROLES = ("response", "position")
"""Roles of channels that are measured."""


def check_resolution(channels: Sequence[Channel]) -> tuple[Check, ...]:
    """Check the quantization of sensor channels: one check per channel whose rms is below `FINE_STEPS` steps, or a
    single "fine" check if there is none. Commands are left out: they may have few values by design."""
    candidates = [_check_channel_resolution(channel) for channel in channels if channel.role in _SENSOR_ROLES]
    checks = tuple(check for check in candidates if check is not None)
    return checks or (Check(RESOLUTION, "fine", "No sensor is limited by the resolution of its converter."),)


def _check_channel_resolution(channel: Channel) -> Check | None:
    """Check the quantization of one channel; None where no quantization step is found, or its rms is at least
    `FINE_STEPS` steps."""
    quantization_step = find_rounding_step(channel.samples)
    rms_in_steps = compute_rms(channel.finite_samples) / quantization_step if quantization_step else FINE_STEPS
    if rms_in_steps >= FINE_STEPS:
        return None
    text = (
        f"{channel.label} has a resolution of {channel.format(quantization_step)}; its rms is {rms_in_steps:.3g} of "
        "these steps."
    )
    if rms_in_steps < HIDDEN_STEPS:
        return Check(RESOLUTION, "wrong", text, "Use a finer sensor or range, or move more: rounding hides the motion.")
    if rms_in_steps < ROUGH_STEPS:
        return Check(
            RESOLUTION,
            "notice",
            text,
            "Do not differentiate it without a filter; expect rounding noise as a lower bound of the error.",
        )
    return Check(RESOLUTION, "fine", text)


@dataclass(frozen=True, slots=True)
class ChannelSummary:
    """Range, mean, rms and number of missing samples of a channel, in its unit. Without finite samples range and mean
    are NaN, and the rms is 0."""

    role: str
    """Role, name, quantity and unit: as in `Channel`."""
    name: str
    quantity: str
    unit: str
    lowest: float
    highest: float
    mean: float
    rms: float
    """Rms about the mean."""
    missing: int
    """Number of samples that are not finite."""


@dataclass(frozen=True, repr=False, slots=True, eq=False)
class Overview(SummaryDisplay):
    """Properties of a recording that need no model: spectra, levels, repeats, consistency and checks."""

    name: str
    """Name of the recording's file."""
    recording: Recording
    channels: tuple[Channel, ...]
    stretches: tuple[Stretch, ...]
    """Parts of the recording that are analysed separately (`find_parts`)."""
    summaries: tuple[ChannelSummary, ...]
    """Summary of each channel, in the order of `channels`."""
    levels: tuple[SegmentLevel, ...]
    """Rms of each channel in each segment."""
    spectra: CrossSpectra | None
    """Cross spectra of all channels; None where no stretch is long enough, or every window lacks samples."""
    bands: tuple[DrivenBand, ...]
    """Driven bands of the excitations, or of the commands where no excitation varies; empty without spectra."""
    coherences: tuple[ResponseCoherence, ...]
    """Coherence of responses with commands in these bands; empty without spectra, and where `estimate_coherences`
    returns none."""
    pairs: tuple[KinematicPair, ...]
    """Pairs of channels of which the second should be a time derivative of the first."""
    repeats: Repeats
    """An undeclared period, and the noise between periods."""
    checks: tuple[Check, ...]
    """All checks, sorted by level: "wrong", then "notice", then "fine"."""

    def summary(self) -> Summary:
        """Summarise range and rms of each channel, and list all checks that are not fine."""
        notable_checks = [check for check in self.checks if check.level != "fine"]
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
                *((check.level, check.finding) for check in notable_checks),
            ),
        )


def make_overview(name: str, recording: Recording) -> Overview:
    """Make the overview of a recording. name: name of the file, for tables and figures. Raises ValueError where
    the lengths or rates of its signals differ, or a segment is invalid."""
    if problems := (*find_length_problems(recording), *find_segment_problems(recording.segments, len(recording))):
        raise ValueError(f"{name} cannot be examined: {'; '.join(problems)}")
    channels, stretches, rate_hz = list_channels(recording), find_parts(recording), recording.sample_rate_hz
    spectra = estimate_cross_spectra(channels, stretches, rate_hz)
    bands = find_driven_bands(spectra, channels) if spectra else ()
    coherences = estimate_coherences(spectra, channels, bands) if spectra else ()
    pairs = find_kinematic_pairs(channels, stretches, rate_hz)
    levels = compute_segment_levels(recording, channels)
    repeats = find_repeats(recording, stretches)
    checks = (
        *check_missing_samples(channels, rate_hz),
        *check_constant_channels(channels),
        *check_copied_channels(channels),
        *check_clock(recording, stretches),
        *check_units(channels),
        *check_kinematics(pairs, rate_hz),
        *(check_lags(channels, spectra, rate_hz) if spectra else ()),
        *check_clipping(channels),
        *check_resolution(channels),
        *check_offsets(channels),
        *check_driven_axes(recording, bands if spectra else None),
        *check_coherences(coherences, recording),
        *check_proportionality(levels, channels),
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
        checks=_sort_by_severity(checks if recording.is_timed else tuple(map(_restate_in_samples, checks))),
    )


def _sort_by_severity(checks: tuple[Check, ...]) -> tuple[Check, ...]:
    """Sort the checks by level; those of one level keep their order."""
    severity = ("wrong", "notice", "fine")
    return tuple(sorted(checks, key=lambda check: severity.index(check.level)))


def _restate_in_samples(check: Check) -> Check:
    """Restate the times of a check in samples, for a recording whose sample rate is not known; the check of the clock
    is unchanged."""
    if check.name == CLOCK:
        return check
    return replace(check, finding=replace_time_units(check.finding), advice=replace_time_units(check.advice))


def _summarise_channel(channel: Channel) -> ChannelSummary:
    """Summarise the finite samples of a channel."""
    finite_samples = channel.finite_samples if channel.finite_samples.size else np.array([np.nan])
    return ChannelSummary(
        channel.role,
        channel.name,
        channel.quantity,
        channel.unit,
        float(finite_samples.min()),
        float(finite_samples.max()),
        float(finite_samples.mean()),
        compute_rms(channel.finite_samples),
        len(channel.samples) - channel.finite_samples.size,
    )
