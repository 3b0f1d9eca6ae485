"""Spectra of commands and responses, segment by segment, with their noise: the data of a mechanical fit.

A periodic segment gives the mean spectrum of its periods: noise, including noise that a feedback adds to the command,
averages out, as with the excitation as an instrument. Any other segment gives the spectrum of its whole length; the
transient from the states at its ends is fitted with the model. Spectra are rfft / length, in the signals' units.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from equalizer.identification.frequency_response.frequency_response import BoolArray
from equalizer.identification.frequency_response.noise_floor import period_variance, smooth_over_lines
from equalizer.signals.recording import Hold, Recording, Segment
from equalizer.signals.signal import ComplexArray, FloatArray
from equalizer.signals.spectral_density import line_spectra

_SPARE = 8
"""Degrees of freedom of the residual in a window: lines beyond the number of unknowns. Heuristic."""


def local_noise(command: ComplexArray, response: ComplexArray) -> FloatArray:
    """(lines, p): expected |error|² of the response. command: (lines, m), response: (lines, p). NaN for fewer lines
    than a window has.

    Noise of the spectrum of a single period: residual power, per degree of freedom, of the fit G(f) U + T(f) in a
    window of neighbouring lines, with G linear and the transient T quadratic in frequency (local polynomial method of
    Schoukens, Vandersteen, Barbé and Pintelon, 2009). It is overestimated where a resonance is narrower than the
    window.
    """
    lines, m = command.shape
    unknowns = 2 * m + 3
    window_lines = unknowns + _SPARE
    if lines < window_lines:
        return np.full(response.shape, np.nan)
    starts = np.arange(0, lines - window_lines + 1, max(1, lines // 4000))
    window = starts[:, None] + np.arange(window_lines)
    offset = np.linspace(-1.0, 1.0, window_lines)
    driven = command[window]
    size = np.maximum(np.abs(driven).max(axis=(1, 2), keepdims=True), 1e-300)
    smooth = np.broadcast_to(offset[:, None] ** np.arange(3), (len(window), window_lines, 3))
    regressors = np.concatenate([driven / size, offset[:, None] * driven / size, smooth], axis=2)
    basis, _ = np.linalg.qr(regressors)
    values = response[window]
    explained_power = np.sum(np.abs(np.swapaxes(basis.conj(), 1, 2) @ values) ** 2, axis=1)
    power = np.maximum(np.sum(np.abs(values) ** 2, axis=1) - explained_power, 0.0) / (window_lines - unknowns)
    centre = starts + window_lines // 2
    return np.stack([np.interp(np.arange(lines), centre, power[:, output]) for output in range(power.shape[1])], axis=1)


EXCITED = 1e-2
"""Amplitude of a line, relative to the strongest, above which it counts as excited. Heuristic."""
MOST_LINES = 2000
"""Largest number of lines of a segment with a transient; of more, every second, third, ... line is used."""
_NOISE_LINES = 9
"""Number of lines over which noise and signal power are averaged."""


@dataclass(frozen=True, slots=True, eq=False)
class SegmentLines:
    """Spectra of a segment: rfft / length, without the mean."""

    frequency_hz: FloatArray
    """(lines,), above zero, in ascending order."""
    command: ComplexArray
    """(lines, m)"""
    response: ComplexArray
    """(lines, p)"""
    noise: FloatArray
    """(lines, p): expected |error|² of `response`; NaN where not known."""
    excited: BoolArray
    """(lines,): whether the excitation has power there, see `EXCITED`."""
    transient: bool
    """Whether the spectra contain a transient, from different states at the two ends."""
    rate_hz: float
    hold: Hold


def segment_lines(recording: Recording, segment: Segment) -> SegmentLines | None:
    """Spectra of a segment; None where it is not excited, or has fewer than eight samples without gaps."""
    starts, length = _whole_periods(recording, segment)
    if not starts or length < 8:
        return None
    rate = recording.sample_rate_hz
    transient = not segment.period or starts == [segment.start]
    spectra = [_spectra(signal.samples, starts, length) for signal in (recording.command, recording.response)]
    excitation = recording.command if recording.excitation is None else recording.excitation
    size = np.linalg.norm(_spectra(excitation.samples, starts, length).mean(axis=0), axis=1)
    if not size.max() > 1e-9 * max(float(np.abs(excitation.samples[segment.start : segment.stop]).max()), 1e-300):
        return None
    command, response = (spectrum.mean(axis=0) for spectrum in spectra)
    if len(starts) > 1:
        noise = smooth_over_lines(period_variance(spectra[1]), _NOISE_LINES) / len(starts)
    else:
        noise = local_noise(command, response)
    if transient:  # a line without power between excited lines counts as excited too
        size = np.sqrt(smooth_over_lines(size**2, _NOISE_LINES))
    frequency = np.arange(1, len(command) + 1) * rate / length
    excited = size > EXCITED * size.max()
    return SegmentLines(frequency, command, response, noise, excited, transient, rate, recording.hold)


def select_band(segments: Sequence[SegmentLines], band_hz: tuple[float, float] | None) -> tuple[SegmentLines, ...]:
    """The excited lines of the band (Hz, ends included; None: all). Periodic segments with the same lines get those
    that any of them excites; a segment with a transient keeps at most about `MOST_LINES`."""
    low, high = band_hz or (0.0, np.inf)
    selected = []
    for segment in segments:
        shared_excited = [candidate.excited for candidate in segments if have_same_lines(segment, candidate)]
        excited = segment.excited if segment.transient else np.any(shared_excited, axis=0)
        chosen = np.flatnonzero(excited & (segment.frequency_hz >= low) & (segment.frequency_hz <= high))
        if segment.transient and len(chosen) > MOST_LINES:
            chosen = chosen[:: -(-len(chosen) // MOST_LINES)]
        if len(chosen):
            selected.append(_select_lines(segment, chosen))
    return tuple(selected)


def have_same_lines(first: SegmentLines, second: SegmentLines) -> bool:
    """Whether two segments have no transient and the same rate, hold and number of lines, hence the same lines."""
    return not (first.transient or second.transient) and (first.rate_hz, first.hold, len(first.frequency_hz)) == (
        second.rate_hz, second.hold, len(second.frequency_hz),
    )  # fmt: skip


def _select_lines(lines: SegmentLines, chosen: npt.NDArray[np.int64]) -> SegmentLines:
    return SegmentLines(
        lines.frequency_hz[chosen],
        lines.command[chosen],
        lines.response[chosen],
        lines.noise[chosen],
        lines.excited[chosen],
        lines.transient,
        lines.rate_hz,
        lines.hold,
    )


def split_fit_and_test(
    recordings: Sequence[Recording],
) -> tuple[list[tuple[Recording, Segment]], list[tuple[Recording, Segment]]]:
    """Segments to fit, and segments to keep for a test. The test are the segments with the role "test"; without such,
    the last of more than 2 m segments (m commands), or the last third of a single segment that is not periodic, else
    none."""
    driven = [(recording, segment) for recording in recordings for segment in _driven_segments(recording)]
    test = [(recording, segment) for recording, segment in driven if segment.role == "test"]
    fit = [(recording, segment) for recording, segment in driven if segment.role != "test"]
    if test or not fit:
        return fit, test
    if len(fit) > 2 * fit[0][0].command.samples.shape[1]:
        return fit[:-1], fit[-1:]
    recording, last_segment = fit[-1]
    if len(fit) == 1 and not last_segment.period:
        middle = last_segment.start + 2 * (last_segment.stop - last_segment.start) // 3
        parts = (
            Segment(last_segment.start, middle, last_segment.kind, last_segment.amplitude, 0, "fit"),
            Segment(middle, last_segment.stop, last_segment.kind, last_segment.amplitude, 0, "test"),
        )
        return [(recording, parts[0])], [(recording, parts[1])]
    return fit, []


def _driven_segments(recording: Recording) -> Iterator[Segment]:
    """Segments other than rest and free decay; the whole recording where it has no segments."""
    if not recording.segments:
        yield Segment(0, len(recording), "noise")
    for segment in recording.segments:
        if segment.kind not in ("rest", "free"):
            yield segment


def _whole_periods(recording: Recording, segment: Segment) -> tuple[list[int], int]:
    """Starts and common length of the whole periods, without the segment's first period where there are others; without
    such periods, start and length of the longest part without missing samples."""
    signals = [recording.command.samples, recording.response.samples]
    if recording.excitation is not None:
        signals.append(recording.excitation.samples)
    is_complete = np.all([np.isfinite(samples).all(axis=1) for samples in signals], axis=0)
    if segment.period >= 8:
        starts = range(segment.start, segment.stop - segment.period + 1, segment.period)
        complete_starts = [start for start in starts if is_complete[start : start + segment.period].all()]
        period_starts = [start for start in complete_starts if start != segment.start] or complete_starts
        if period_starts:
            return period_starts, segment.period
    ends = np.flatnonzero(~np.concatenate([[False], is_complete[segment.start : segment.stop], [False]]))
    longest = int(np.argmax(np.diff(ends)))
    start, length = segment.start + int(ends[longest]), int(np.diff(ends)[longest]) - 1
    return ([start] if length > 0 else []), length


def _spectra(samples: FloatArray, starts: Sequence[int], length: int) -> ComplexArray:
    """Spectra (periods, lines, channels), one period per start."""
    periods = np.stack([samples[start : start + length] for start in starts])
    return line_spectra(periods - periods.mean(axis=1, keepdims=True))
