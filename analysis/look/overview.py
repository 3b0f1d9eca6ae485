"""Everything that can be said of a recording before any model."""

from dataclasses import dataclass

import numpy as np

from analysis.look.channels import Channel, Stretch, channels_of, rms, stretches_of
from analysis.look.check import Check
from analysis.look.clipping import clipping
from analysis.look.clock import clock
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
from analysis.look.resolution import resolution
from equalizer.signals.recording import Recording


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


@dataclass(frozen=True, slots=True, eq=False)
class Overview:
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
    severity = ("wrong", "notice", "fine")
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
        checks=tuple(sorted(checks, key=lambda check: severity.index(check.level))),
    )


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
