"""Checks of the excitation: driven frequency band of each excitation or command, multiple coherence of each response
with all commands, and segments without excitation.

The multiple coherence of a response with q inputs is S_xy^H S_xx^-1 S_xy / S_yy at each spectral line, between 0 and 1.
Source: J. S. Bendat, A. G. Piersol, Random Data, 4th ed., Wiley 2010, chapter 7. Unrelated signals have, for n averaged
windows, a mean of q / n, which is subtracted.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from analysis.look.channels import Channel, is_driven, list_channels
from analysis.look.check import FREE_ADVICE, UNDRIVEN_ADVICE, Check
from analysis.look.cross_spectra import CrossSpectra
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray

DRIVEN_CHECK, COHERENCE_CHECK = "driven axes", "coherence"
LEAST_RELATIVE_DENSITY = 1e-2
"""Power spectral density, relative to the highest of the command, above which a line is driven. All limits of this
module are chosen."""
LEAST_RELATIVE_POWER = 1e-4
"""Power, relative to the strongest command of the same unit, below which a command is not driven."""
LOW_COHERENCE, POOR_COHERENCE = 0.8, 0.1
"""Coherent share of a response's power below which there is a notice, and below which the check is "wrong" (the channel
may be a wrong one)."""
_BROADBAND_KINDS = frozenset({"multisine", "noise", "binary", "sweep", "rest"})
"""Kinds of segments (`Segment.kind`) for which the estimate of coherence by windows is reliable."""
_NOTABLE_SHARE = 0.01
"""Least share of a response's power that an octave must contain to be reported."""


@dataclass(frozen=True, slots=True)
class DrivenBand:
    """The frequency band in which a command is driven: from the first to the last driven line."""

    command: str
    """Name of the channel: of a command, or of an excitation."""
    low_hz: float
    high_hz: float


@dataclass(frozen=True, slots=True, eq=False)
class ResponseCoherence:
    """Multiple coherence of a response with all driven commands, and the octave of the driven band where it is
    lowest."""

    response: str
    multiple: FloatArray
    """(lines,): share of the response's power that is linear in all commands together, 0 to 1."""
    share: float
    """That share for the whole driven band: the coherence averaged with the response's power as weight."""
    lowest_hz: float
    """Geometric centre of the octave with the lowest share, of those that contain a notable part of the power."""
    lowest: float
    """Share of that octave."""


def find_driven_bands(spectra: CrossSpectra, channels: Sequence[Channel]) -> tuple[DrivenBand, ...]:
    """Find the driven band of each excitation if an excitation varies, else of each command. Channels that are not
    driven are left out."""
    role = (
        "excitation"
        if any(candidate.is_varying and candidate.role == "excitation" for candidate in channels)
        else "command"
    )
    bands = []
    powers = {index: spectra.get_power_density(index) for index, channel in enumerate(channels) if channel.role == role}
    for index, power in powers.items():
        same_unit_powers = [
            other_power.sum()
            for other_index, other_power in powers.items()
            if channels[other_index].unit == channels[index].unit
        ]
        if power.max() <= 0 or power.sum() < LEAST_RELATIVE_POWER * max(same_unit_powers):
            continue
        lines = spectra.frequency_hz[power > LEAST_RELATIVE_DENSITY * power.max()]
        bands.append(DrivenBand(channels[index].name, float(lines[0]), float(lines[-1])))
    return tuple(bands)


def estimate_coherences(
    spectra: CrossSpectra, channels: Sequence[Channel], bands: Sequence[DrivenBand]
) -> tuple[ResponseCoherence, ...]:
    """Estimate the multiple coherence of each varying response with all driven commands. bands: driven bands, by the
    names of the commands, which excitations share. Empty if no command is driven, or if fewer than 2 q + 2 windows were
    averaged for q inputs."""
    inputs = [
        index
        for index, candidate in enumerate(channels)
        if candidate.role == "command" and candidate.name in {band.command for band in bands}
    ]
    if not inputs or spectra.windows < 2 * len(inputs) + 2:
        return ()
    low, high = min(band.low_hz for band in bands), max(band.high_hz for band in bands)
    in_band = (spectra.frequency_hz >= low) & (spectra.frequency_hz <= high)
    coherences = []
    for index, channel in enumerate(channels):
        if channel.role == "response" and channel.is_varying:
            multiple = _estimate_multiple_coherence(spectra, inputs, index)
            power = spectra.get_power_density(index)[in_band]
            worst_hz, worst = _find_worst_octave(spectra.frequency_hz[in_band], multiple[in_band], power)
            share = _average_coherence(multiple[in_band], power)
            coherences.append(ResponseCoherence(channel.name, multiple, share, worst_hz, worst))
    return tuple(coherences)


def _estimate_multiple_coherence(spectra: CrossSpectra, inputs: list[int], response: int) -> FloatArray:
    """Estimate the multiple coherence (lines,) of the response with the inputs (indices of channels), less its mean for
    unrelated signals and rescaled, so that it averages about 0 for these and is 1 for a linear relation."""
    input_spectra = spectra.matrix[:, inputs][:, :, inputs]
    # Diagonal loading: the spectral matrix of collinear commands is singular.
    diagonal_loading = 1e-9 * np.trace(input_spectra, axis1=1, axis2=2).real.clip(min=np.finfo(np.float64).tiny)
    regularised = input_spectra + diagonal_loading[:, None, None] * np.eye(len(inputs))
    cross_spectrum = spectra.matrix[:, inputs, response]
    coherent_power = np.einsum(
        "li,li->l", cross_spectrum.conj(), np.linalg.solve(regularised, cross_spectrum[..., None])[..., 0]
    ).real
    power = spectra.get_power_density(response)
    uncorrected = np.clip(coherent_power / np.where(power > 0, power, np.inf), 0.0, 1.0)
    chance_coherence = len(inputs) / spectra.windows
    return np.asarray(np.clip((uncorrected - chance_coherence) / (1 - chance_coherence), 0.0, 1.0))


def _find_worst_octave(frequency_hz: FloatArray, coherence: FloatArray, power: FloatArray) -> tuple[float, float]:
    """Find the octave with the lowest coherent share of power, of those with at least `_NOTABLE_SHARE` of the power.
    Returns its geometric centre (Hz) and that share. All arguments: (lines,), at least one line."""
    octaves = np.floor(np.log2(frequency_hz))
    coherence_by_octave = {}
    for octave in np.unique(octaves):
        octave_power = power[octaves == octave]
        if octave_power.sum() >= _NOTABLE_SHARE * power.sum():
            coherence_by_octave[float(octave)] = _average_coherence(coherence[octaves == octave], octave_power)
    worst = min(coherence_by_octave, key=lambda octave: coherence_by_octave[octave])
    return float(2.0 ** (worst + 0.5)), coherence_by_octave[worst]


def _average_coherence(coherence: FloatArray, power: FloatArray) -> float:
    """Average the coherence with the power as weight; 0 without any power. Both arguments: (lines,)."""
    total_power = power.sum()
    return float(np.sum(coherence * power) / total_power) if total_power > 0 else 0.0


def check_driven_axes(recording: Recording, bands: Sequence[DrivenBand] | None) -> tuple[Check, ...]:
    """Check the excitation: a notice for each command that is not driven, "wrong" for each segment that states an
    amplitude without excitation, and a "fine" check with all driven bands, if any. bands: None = not known, because no
    spectra were computed; no command is then called undriven."""
    driven_names = set(recording.command.channels) if bands is None else {band.command for band in bands}
    advice = UNDRIVEN_ADVICE if is_driven(list_channels(recording)) else FREE_ADVICE
    undriven_commands = [name for name in recording.command.channels if name not in driven_names]
    checks = [Check(DRIVEN_CHECK, "notice", f"command '{name}' is not driven.", advice) for name in undriven_commands]
    checks += [
        Check(DRIVEN_CHECK, "wrong", sentence, "Correct the segments.") for sentence in find_silent_segments(recording)
    ]
    bands_text = "; ".join(f"'{band.command}' from {band.low_hz:.3g} to {band.high_hz:.3g} Hz" for band in bands or ())
    return (*checks, *((Check(DRIVEN_CHECK, "fine", f"Driven bands: {bands_text}."),) if bands_text else ()))


def find_silent_segments(recording: Recording) -> tuple[str, ...]:
    """List a sentence for each segment that states an amplitude, but in which all commands are zero. Segments of rest,
    free motion and impacts have no command and are left out."""
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


def check_coherences(coherences: Sequence[ResponseCoherence], recording: Recording) -> tuple[Check, ...]:
    """Check each coherence. Without segments, with others than `_BROADBAND_KINDS`, and with an excitation that is no
    command (feedback controllers), the estimate by windows is unreliable: a notice at most."""
    kinds = {segment.kind for segment in recording.segments}
    is_broadband = bool(kinds) and kinds <= _BROADBAND_KINDS and recording.excitation is None
    return tuple(_check_coherence(coherence, is_broadband) for coherence in coherences)


def _check_coherence(coherence: ResponseCoherence, is_broadband: bool) -> Check:
    """Check the coherence of one response: "wrong" below `POOR_COHERENCE` with a broadband excitation, a notice below
    `LOW_COHERENCE`, else "fine"."""
    text = (
        f"Of the power of response '{coherence.response}' in the driven band, {coherence.share:.1%} is linear in the "
        f"commands, least around {coherence.lowest_hz:.3g} Hz ({coherence.lowest:.0%})."
    )
    if coherence.share < POOR_COHERENCE and is_broadband:
        return Check(
            COHERENCE_CHECK,
            "wrong",
            text,
            "Look for a wrong channel, a large time shift, or an input that was not recorded.",
        )
    if coherence.share < LOW_COHERENCE:
        return Check(
            COHERENCE_CHECK,
            "notice",
            text,
            "Expect noise, a nonlinearity, motion slower than a window, or an input that was not recorded.",
        )
    return Check(COHERENCE_CHECK, "fine", text)
