"""Driven frequency band of each command, and multiple coherence of each response with all commands."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from analysis.look.channels import Channel
from analysis.look.check import Check
from analysis.look.cross_spectra import CrossSpectra
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray

DRIVEN, COHERENCE = "driven axes", "coherence"
BELOW_PEAK = 1e-2
"""Share of the highest density below which a line is not driven."""
LEAST_DRIVE = 1e-4
"""Power relative to the strongest command of the same unit, below which a command is not driven."""
LOW_COHERENCE, POOR_COHERENCE = 0.8, 0.1
"""Coherent share of a response's power below which it is reported, and below which the channel may be a wrong one."""
_BROADBAND_KINDS = frozenset({"multisine", "noise", "binary", "sweep", "rest"})
_NOTABLE_SHARE = 0.01
"""Share of a response's power in an octave that is worth naming."""


@dataclass(frozen=True, slots=True)
class DrivenBand:
    """The frequency band that a command drives."""

    command: str
    low_hz: float
    high_hz: float


@dataclass(frozen=True, slots=True, eq=False)
class ResponseCoherence:
    """Multiple coherence of a response with all commands, and where in the driven band it is lowest."""

    response: str
    multiple: FloatArray
    """(lines,): share of its power that all commands together explain linearly, 0 to 1."""
    share: float
    """Share of its power in the driven band."""
    lowest_hz: float
    """Middle of the worst octave there, of those that hold some of its power."""
    lowest: float
    """Share of the power of that octave."""


def find_driven_bands(spectra: CrossSpectra, channels: Sequence[Channel]) -> tuple[DrivenBand, ...]:
    """Driven band of each excitation where it was recorded, else of each command."""
    role = "excitation" if any(_does_change(c) and c.role == "excitation" for c in channels) else "command"
    bands = []
    powers = {k: spectra.power(k) for k, channel in enumerate(channels) if channel.role == role}
    for k, power in powers.items():
        same_unit_powers = [
            other_power.sum() for j, other_power in powers.items() if channels[j].unit == channels[k].unit
        ]
        if power.max() <= 0 or power.sum() < LEAST_DRIVE * max(same_unit_powers):
            continue
        lines = spectra.frequency_hz[power > BELOW_PEAK * power.max()]
        bands.append(DrivenBand(channels[k].name, float(lines[0]), float(lines[-1])))
    return tuple(bands)


def _does_change(channel: Channel) -> bool:
    return bool(channel.finite_samples.size and np.ptp(channel.finite_samples) > 0)


def response_coherences(
    spectra: CrossSpectra, channels: Sequence[Channel], bands: Sequence[DrivenBand]
) -> tuple[ResponseCoherence, ...]:
    """Coherence of each response with the driven commands, by band. Empty where nothing is driven, or too few windows
    were averaged."""
    inputs = [k for k, c in enumerate(channels) if c.role == "command" and c.name in {band.command for band in bands}]
    if not inputs or spectra.windows < 2 * len(inputs) + 2:
        return ()
    low, high = min(band.low_hz for band in bands), max(band.high_hz for band in bands)
    in_band = (spectra.frequency_hz >= low) & (spectra.frequency_hz <= high)
    coherences = []
    for k, channel in enumerate(channels):
        if channel.role == "response" and _does_change(channel):
            multiple = _multiple_coherence(spectra, inputs, k)
            power = spectra.power(k)[in_band]
            worst_hz, worst = _worst_octave(spectra.frequency_hz[in_band], multiple[in_band], power)
            share = float(np.sum(multiple[in_band] * power) / np.sum(power))
            coherences.append(ResponseCoherence(channel.name, multiple, share, worst_hz, worst))
    return tuple(coherences)


def _multiple_coherence(spectra: CrossSpectra, inputs: list[int], response: int) -> FloatArray:
    """Multiple coherence (lines,), corrected for its chance value with as many windows."""
    power_in = spectra.matrix[:, inputs][:, :, inputs]
    # A hint of independent noise in every command keeps collinear ones from being divided by nothing.
    floor = 1e-9 * np.trace(power_in, axis1=1, axis2=2).real.clip(min=np.finfo(np.float64).tiny)
    regular = power_in + floor[:, None, None] * np.eye(len(inputs))
    cross_power = spectra.matrix[:, inputs, response]
    coherent_power = np.einsum(
        "li,li->l", cross_power.conj(), np.linalg.solve(regular, cross_power[..., None])[..., 0]
    ).real
    power = spectra.power(response)
    uncorrected = np.clip(coherent_power / np.where(power > 0, power, np.inf), 0.0, 1.0)
    chance_share = len(inputs) / spectra.windows
    return np.asarray(np.clip((uncorrected - chance_share) / (1 - chance_share), 0.0, 1.0))


def _worst_octave(frequency_hz: FloatArray, coherence: FloatArray, power: FloatArray) -> tuple[float, float]:
    octaves = np.floor(np.log2(frequency_hz))
    shares = {}
    for octave in np.unique(octaves):
        octave_power = power[octaves == octave]
        if octave_power.sum() >= _NOTABLE_SHARE * power.sum():
            shares[float(octave)] = float(np.sum(coherence[octaves == octave] * octave_power) / octave_power.sum())
    worst = min(shares, key=lambda octave: shares[octave])
    return float(2.0 ** (worst + 0.5)), shares[worst]


def check_driven_axes(recording: Recording, bands: Sequence[DrivenBand]) -> tuple[Check, ...]:
    """Commands that never move, and segments that name an excitation that is not there."""
    driven = {band.command for band in bands}
    idle = [name for name in recording.command.channels if name not in driven]
    checks = [
        Check(
            DRIVEN,
            "notice",
            f"command '{name}' is not driven.",
            "Its effect cannot be determined; leave it out, or record it driven.",
        )
        for name in idle
    ]
    checks += [Check(DRIVEN, "wrong", sentence, "Correct the segments.") for sentence in silent_segments(recording)]
    text = "; ".join(f"'{band.command}' is driven from {band.low_hz:.3g} to {band.high_hz:.3g} Hz" for band in bands)
    return (*checks, *((Check(DRIVEN, "fine", f"Command {text}."),) if text else ()))


def silent_segments(recording: Recording) -> tuple[str, ...]:
    """Segments that state an amplitude, but in which no command moves."""
    sentences = []
    for number, segment in enumerate(recording.segments, start=1):
        segment_samples = recording.command.samples[segment.start : segment.stop]
        finite = segment_samples[np.isfinite(segment_samples)]
        is_silent = finite.size > 0 and not finite.any()
        if segment.kind not in ("rest", "free", "impact") and segment.amplitude > 0 and is_silent:
            sentences.append(
                f"Segment {number} is a {segment.kind} of amplitude {segment.amplitude:g}, but no command moves in it."
            )
    return tuple(sentences)


def coherence_checks(coherences: Sequence[ResponseCoherence], recording: Recording) -> tuple[Check, ...]:
    """Checks of the coherences. For single steps, slow signals and controllers, windows are no good estimate: a notice
    at most."""
    kinds = {segment.kind for segment in recording.segments}
    broad = bool(kinds) and kinds <= _BROADBAND_KINDS and recording.excitation is None
    return tuple(_coherence_check(coherence, broad) for coherence in coherences)


def _coherence_check(coherence: ResponseCoherence, broad: bool) -> Check:
    text = (
        f"Of the power of response '{coherence.response}' in the driven band, {coherence.share:.1%} is linear in the "
        f"commands, least around {coherence.lowest_hz:.3g} Hz ({coherence.lowest:.0%})."
    )
    if coherence.share < POOR_COHERENCE and broad:
        return Check(
            COHERENCE, "wrong", text, "Look for a wrong channel, a large time shift, or an input that was not recorded."
        )
    if coherence.share < LOW_COHERENCE:
        return Check(
            COHERENCE,
            "notice",
            text,
            "Expect noise, a nonlinearity, motion slower than a window, or an input that was not recorded.",
        )
    return Check(COHERENCE, "fine", text)
