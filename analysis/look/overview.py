"""Everything that can be said of a recording before any model."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from analysis.diagnosis.noise.rounding import rounding_step
from analysis.look.channels import Channel, Stretch, channels_of, rms, stretches_of
from analysis.look.check import Check
from analysis.look.clipping import clipping
from analysis.look.clock import CLOCK, clock
from analysis.look.completeness import constant_channels, copied_channels, missing_samples
from analysis.look.cross_spectra import CrossSpectra, cross_spectra
from analysis.look.driven_band import (
    DrivenBand,
    ResponseCoherence,
    coherence_checks,
    driven_axes,
    driven_bands,
    response_coherences,
)
from analysis.look.kinematics import KinematicPair, kinematic_checks, kinematic_pairs, lag_checks
from analysis.look.levels import SegmentLevel, level_checks, segment_levels
from analysis.look.plausibility import offsets, units
from analysis.look.repeats import Repeats, repeat_checks, repeats
from analysis.wording import untimed_text
from equalizer.signals.recording import Recording
from equalizer.signals.summary import Summarised, Summary

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


@dataclass(frozen=True, slots=True)
class ChannelSummary:
    role: str
    name: str
    quantity: str
    unit: str
    lowest: float
    highest: float
    mean: float
    rms: float
    """About the mean."""
    missing: int


@dataclass(frozen=True, repr=False, slots=True, eq=False)
class Overview(Summarised):
    name: str
    recording: Recording
    channels: tuple[Channel, ...]
    stretches: tuple[Stretch, ...]
    summaries: tuple[ChannelSummary, ...]
    levels: tuple[SegmentLevel, ...]
    spectra: CrossSpectra | None
    """None where no stretch is long enough, or whole."""
    bands: tuple[DrivenBand, ...]
    coherences: tuple[ResponseCoherence, ...]
    pairs: tuple[KinematicPair, ...]
    repeats: Repeats
    checks: tuple[Check, ...]
    """Wrong ones first, then what should be noticed, then what is fine."""

    def summary(self) -> Summary:
        noticed = [check for check in self.checks if check.level != "fine"]
        return Summary(
            f"{self.name}: {len(self.channels)} channels",
            (
                *(
                    (
                        f"{each.role} {each.name}",
                        f"{each.lowest:.4g} to {each.highest:.4g} {each.unit}, rms {each.rms:.3g}",
                    )
                    for each in self.summaries
                ),
                *((check.level, check.seen) for check in noticed),
            ),
        )


def overview(name: str, recording: Recording) -> Overview:
    """name: of the file, for tables and figures."""
    channels, stretches, rate_hz = channels_of(recording), stretches_of(recording), recording.sample_rate_hz
    spectra = cross_spectra(channels, stretches, rate_hz)
    bands = driven_bands(spectra, channels) if spectra else ()
    coherences = response_coherences(spectra, channels, bands) if spectra else ()
    pairs = kinematic_pairs(channels, stretches, rate_hz)
    levels = segment_levels(recording, channels)
    repeated = repeats(recording, stretches)
    checks = (
        *missing_samples(channels, rate_hz),
        *constant_channels(channels),
        *copied_channels(channels),
        *clock(recording, stretches),
        *units(channels),
        *kinematic_checks(pairs, rate_hz),
        *(lag_checks(channels, spectra, rate_hz) if spectra else ()),
        *clipping(channels),
        *resolution(channels),
        *offsets(channels),
        *driven_axes(recording, bands),
        *coherence_checks(coherences, recording),
        *level_checks(levels, channels),
        *repeat_checks(recording, repeated),
    )
    return Overview(
        name=name,
        recording=recording,
        channels=channels,
        stretches=stretches,
        summaries=tuple(_summary(channel) for channel in channels),
        levels=levels,
        spectra=spectra,
        bands=bands,
        coherences=coherences,
        pairs=pairs,
        repeats=repeated,
        checks=_worst_first(checks if recording.is_timed else tuple(map(_in_samples, checks))),
    )


def _worst_first(checks: tuple[Check, ...]) -> tuple[Check, ...]:
    severity = ("wrong", "notice", "fine")
    return tuple(sorted(checks, key=lambda check: severity.index(check.level)))


def _in_samples(check: Check) -> Check:
    """Of a recording of which no time is known; the check of the clock says just that."""
    if check.name == CLOCK:
        return check
    return replace(check, seen=untimed_text(check.seen), do=untimed_text(check.do))


def _summary(channel: Channel) -> ChannelSummary:
    known = channel.known if channel.known.size else np.array([np.nan])
    return ChannelSummary(
        channel.role,
        channel.name,
        channel.quantity,
        channel.unit,
        float(known.min()),
        float(known.max()),
        float(known.mean()),
        rms(channel.known),
        len(channel.samples) - channel.known.size,
    )
