"""Nonlinear distortion by kind (odd, even, varying), from the repeated periods and the silent lines of a periodic
excitation: one value per channel, input, level and band. `Distortions.remarks` says what the recording cannot show.

Theory. A linear, time-invariant device responds to a multisine on its driven lines only. Where all driven lines are odd
multiples k f0, a term of odd order in the motion (friction, backlash, a cubic spring) makes sums and differences of an
odd number of odd lines, which are odd; a term of even order makes even lines. So the power of the response on multiples
that were left silent (detection lines), beyond the noise, is distortion, and the parity of the line shows the kind. Per
kind and band, with S the set of silent lines of that kind,

    D² = 2 L/|S| sum over k in S of (|Y(k)|² - E|N(k)|²)

    Y: mean spectrum over the periods; N: its noise; L: number of lines, driven ones included, that the kind reaches

because distortion of driven lines, which the response hides, is taken to be as strong as on the silent lines next to
them. What differs between periods by more than the noise ("varying") is no function of a periodic motion: drift, a
moving hand, friction that depends on its history. Its power is the variance between periods beyond that of the noise.
p-values: the ratio of the power to the power of the noise is F-distributed (`compute_excess_power`).

References: Pintelon and Schoukens, System Identification: A Frequency Domain Approach (2012), chapter 4; Schoukens,
Vaes and Pintelon, IEEE Control Systems 36 (2016), 38.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from analysis.diagnosis.data.spectral_lines import (
    Band,
    DetectionLines,
    compute_excess_power,
    compute_hold_samples,
    find_detection_lines,
    list_octaves,
    select_lines_in_band,
)
from analysis.diagnosis.localisation.segment_spectra import SegmentSpectrum, compute_segment_spectra
from analysis.diagnosis.noise.noise_floor import NoiseFloor
from analysis.diagnosis.noise.periods import Periods, compute_period_spectra, find_settled_periods
from analysis.diagnosis.types import Mask
from equalizer.identification.frequency_response.experiments import select_instrument_signal
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray, Signal

Kind = Literal["odd", "even", "either", "varying"]
"""Odd and even distortion; distortion of either kind where even lines were driven; variation between periods beyond the
noise."""


class _Cell(NamedTuple):
    """Output, input, level, band and noise of a value of distortion: the first six fields of a `Distortion`."""

    output: str
    quantity: str
    input: str
    amplitude: float
    band_hz: Band
    noise_rms: float


@dataclass(frozen=True, slots=True)
class Distortion:
    """One kind of distortion of one output channel, at one input, level and band (a cell)."""

    output: str
    """Name of the channel."""
    quantity: str
    """Quantity of the output: position and response channels may share a name."""
    input: str
    """Driven inputs, joined by "+"."""
    amplitude: float
    """Level of the segment's excitation, in the command's unit."""
    band_hz: Band
    """Lower and upper end, Hz."""
    noise_rms: float
    """Rms noise of the channel in the same recording, over all frequencies; NaN where unknown."""
    whole_band: bool
    """True: all octaves of the driven band; False: one of them."""
    kind: Kind
    rms: float
    """Rms distortion in the output's unit, over all lines of the band that this kind reaches; 0 where not above the
    noise."""
    limit_rms: float
    """Detection limit, rms in the output's unit: of a power of two standard errors of the noise's."""
    signal_rms: float
    """Rms response on the driven lines of the band, in the output's unit."""
    p_value: float
    """Probability of at least so much power from noise alone."""
    lines: int
    """Number of lines that were evaluated."""


@dataclass(frozen=True, slots=True)
class Distortions:
    """Distortion by cell, and sentences on the kinds that the recording cannot show."""

    cells: tuple[Distortion, ...]
    """One per channel, periodic segment (its inputs and level), band and kind that the recording can show; may be
    empty."""
    remarks: tuple[str, ...]
    """Sentences for the user."""


def find_distortions(recordings: Sequence[Recording], floors: Sequence[NoiseFloor]) -> Distortions:
    """Find the distortion of each channel of response and position, per input, level and band (the whole driven band
    and each octave of it).

    floors: noise of each recording; where none is known, or nothing is periodic, no cell is evaluated and a remark says
    so.
    """
    known = [(recording, floor) for recording, floor in zip(recordings, floors, strict=True) if floor.is_known]
    if not known:
        return Distortions((), ("The noise is not known, so distortion cannot be distinguished from it.",))
    evaluated_periods: list[tuple[Periods, DetectionLines]] = []
    cells: list[Distortion] = []
    for recording, floor in known:
        recording_periods = _find_evaluated_periods(recording)
        evaluated_periods += recording_periods
        signals = [(recording.response, floor.response)] if recording_periods else []
        if signals and recording.position is not None and floor.position is not None:
            signals.append((recording.position, floor.position))
        for signal, noise in signals:
            for spectrum in compute_segment_spectra(recording, signal, noise, floor.frequency_hz, recording_periods):
                cells += _compute_cells(spectrum, signal, noise.rms)
    if not evaluated_periods:
        return Distortions((), ("Nothing is periodic in this recording: kinds of distortion cannot be distinguished.",))
    return Distortions(tuple(cells), tuple(_list_untestable_remarks(evaluated_periods)))


def _find_evaluated_periods(recording: Recording) -> list[tuple[Periods, DetectionLines]]:
    """Find the repeated periods of a recording's segments, with their driven and silent lines."""
    settled_periods = find_settled_periods(recording)
    excitation = select_instrument_signal(recording)
    hold_samples = compute_hold_samples(excitation)
    detection_lines = [
        find_detection_lines(compute_period_spectra(excitation, period).mean(axis=0), hold_samples)
        for period in settled_periods
    ]
    return [
        (period, lines) for period, lines in zip(settled_periods, detection_lines, strict=True) if lines is not None
    ]


def _list_untestable_remarks(periods: Sequence[tuple[Periods, DetectionLines]]) -> list[str]:
    """List sentences on what this excitation cannot show about distortion, and why."""
    remarks = []
    if all(period.count < 2 for period, _ in periods):
        remarks.append("No period was repeated: variation from period to period cannot be measured.")
    if not all(period.settled for period, _ in periods):
        remarks.append("Some segments have one period only: the transient at its start counts as distortion.")
    if len({period.segment.amplitude for period, _ in periods}) < 2:
        remarks.append("There is one level only: how distortion changes with the level cannot be measured.")
    if not any(lines.has_silent for _, lines in periods):
        remarks.append(
            "There are no silent (undriven) lines: distortion on driven lines cannot be distinguished from the "
            "response."
        )
    elif not any(lines.even.any() for _, lines in periods):
        remarks.append("Even lines were driven, too: odd and even distortion cannot be distinguished.")
    elif not any(lines.odd.any() for _, lines in periods):
        remarks.append("Every odd line was driven: odd distortion cannot be distinguished from the response.")
    return remarks


def _compute_cells(spectrum: SegmentSpectrum, signal: Signal, noise_rms: FloatArray) -> list[Distortion]:
    """Compute the distortions of all channels and bands of one segment. noise_rms: (channels,)."""
    lowest_hz, highest_hz = (float(line) for line in spectrum.frequency_hz[spectrum.lines.driven][[0, -1]])
    cells = []
    octaves = list_octaves(lowest_hz, highest_hz)
    for band in dict.fromkeys(((octaves[0][0], octaves[-1][1]), *octaves)):
        in_band = select_lines_in_band(spectrum.frequency_hz, band)
        if (in_band & spectrum.lines.driven).any():
            for index, name in enumerate(signal.channels):
                cell = _Cell(
                    name, signal.quantities[index], spectrum.input, spectrum.amplitude, band, float(noise_rms[index])
                )
                cells += _compute_distortions(spectrum, index, in_band, cell, band == (octaves[0][0], octaves[-1][1]))
    return cells


def _compute_distortions(
    spectrum: SegmentSpectrum, channel: int, in_band: Mask, cell: _Cell, whole_band: bool
) -> list[Distortion]:
    """Compute all kinds of distortion in one cell. in_band: (lines,), the lines of its band. whole_band: whether that
    is the whole driven band."""
    power, noise_power = np.abs(spectrum.mean[:, channel]) ** 2, spectrum.mean_variance[:, channel]
    signal_rms = float(np.sqrt(2 * np.sum(power[in_band & spectrum.lines.driven])))
    excess_by_kind: list[tuple[Kind, tuple[float, float, float], float, int]] = []
    for kind, is_detection, reached_lines in _list_detection_masks(spectrum, in_band):
        # Each line's noise has a real and an imaginary part in each of count - 1 differences between periods.
        degrees_of_freedom = float(2 * max(spectrum.count - 1, 1) * is_detection.sum())
        distortion_power = compute_excess_power(power[is_detection], noise_power[is_detection], degrees_of_freedom)
        excess_by_kind.append((kind, distortion_power, reached_lines / is_detection.sum(), int(is_detection.sum())))
    if spectrum.count > 1:
        # Each line has count - 1 independent differences between periods, whose mean square is the variance; the sum
        # over them is divided by count - 1 again below.
        period_variances = np.repeat(spectrum.period_variance[in_band, channel], spectrum.count - 1)
        distortion_power = compute_excess_power(
            period_variances,
            np.repeat(spectrum.noise_variance[in_band, channel], spectrum.count - 1),
            float(spectrum.noise_freedom[channel]),
        )
        excess_by_kind.append(("varying", distortion_power, 1 / (spectrum.count - 1), int(in_band.sum())))
    return [
        Distortion(
            *cell,
            whole_band,
            kind,
            _compute_rms(scale * distortion_power),
            _compute_rms(scale * power_limit),
            signal_rms,
            p_value,
            lines,
        )
        for kind, (distortion_power, power_limit, p_value), scale, lines in excess_by_kind
    ]


def _list_detection_masks(spectrum: SegmentSpectrum, in_band: Mask) -> list[tuple[Kind, Mask, int]]:
    """List the kinds of distortion with their lines in the band, and the number of lines of the band that each kind
    reaches."""
    line_numbers = np.arange(1, len(in_band) + 1)
    is_multiple = in_band & (line_numbers % spectrum.lines.step == 0)
    is_odd = line_numbers // spectrum.lines.step % 2 == 1
    kind_masks: list[tuple[Kind, Mask, int]] = [
        ("odd", np.asarray(in_band & spectrum.lines.odd), int((is_multiple & is_odd).sum())),
        ("even", np.asarray(in_band & spectrum.lines.even), int((is_multiple & ~is_odd).sum())),
        ("either", np.asarray(in_band & spectrum.lines.either), int(is_multiple.sum())),
    ]
    return [kind for kind in kind_masks if kind[1].any()]


def _compute_rms(power: float) -> float:
    """Compute the rms from a sum of squared magnitudes of a one-sided spectrum of complex amplitudes divided by the
    number of samples: a sine of peak A has the magnitude A/2, and A²/2 = 2 (A/2)². Negative sums, which noise alone
    gives, count as 0."""
    return float(np.sqrt(2 * max(power, 0.0)))
