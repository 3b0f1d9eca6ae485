"""Spectra of commands and responses, segment by segment, with their noise: the data of a mechanical fit.

A periodic segment gives the mean spectrum of its periods: noise, including noise that a feedback adds to the command,
averages out. Any other segment gives a spectrum of each of its runs without gaps (`compute_all_lines`); the transient
from the states at the ends of a run is fitted with the model. Spectra are rfft / length, in the signals' units.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from equalizer.identification.frequency_response.noise_floor import compute_period_variance, smooth_over_lines
from equalizer.signals.recording import Hold, Recording, Segment, list_segments
from equalizer.signals.signal import BoolArray, ComplexArray, FloatArray, find_runs
from equalizer.signals.spectral_density import compute_line_spectra

_RESIDUAL_FREEDOM = 8
"""Degrees of freedom of the residual in a window: number of lines minus number of unknowns. Heuristic."""


def estimate_local_noise(command: ComplexArray, response: ComplexArray) -> FloatArray:
    """Estimate the noise power, (lines, p): expected |error|² of the response. command: (lines, m), response: (lines,
    p). NaN for fewer lines than a window has.

    Noise of the spectrum of a single period: residual power, per degree of freedom, of the fit G(f) U + T(f) in a
    window of neighbouring lines, with G linear and the transient T quadratic in frequency (local polynomial method of
    Schoukens, Vandersteen, Barbé and Pintelon, 2009). It is overestimated where a resonance is narrower than the
    window.
    """
    lines, inputs = command.shape
    unknowns = 2 * inputs + 3
    window_lines = unknowns + _RESIDUAL_FREEDOM
    if lines < window_lines:
        return np.full(response.shape, np.nan)
    # A window begins at every line or, of 8000 lines or more (chosen), at every k-th: fewer windows take less time.
    starts = np.arange(0, lines - window_lines + 1, max(1, lines // 4000))
    window_indices = starts[:, None] + np.arange(window_lines)
    relative_frequency = np.linspace(-1.0, 1.0, window_lines)
    window_commands = command[window_indices]
    command_scale = np.maximum(np.abs(window_commands).max(axis=(1, 2), keepdims=True), 1e-300)
    transient_columns = np.broadcast_to(
        relative_frequency[:, None] ** np.arange(3), (len(window_indices), window_lines, 3)
    )
    regressors = np.concatenate(
        [
            window_commands / command_scale,
            relative_frequency[:, None] * window_commands / command_scale,
            transient_columns,
        ],
        axis=2,
    )
    basis, _ = np.linalg.qr(regressors)
    window_responses = response[window_indices]
    explained_power = np.sum(np.abs(np.swapaxes(basis.conj(), 1, 2) @ window_responses) ** 2, axis=1)
    noise_power = np.maximum(np.sum(np.abs(window_responses) ** 2, axis=1) - explained_power, 0.0) / (
        window_lines - unknowns
    )
    window_centres = starts + window_lines // 2
    return np.stack(
        [np.interp(np.arange(lines), window_centres, noise_power[:, output]) for output in range(noise_power.shape[1])],
        axis=1,
    )


LEAST_EXCITED_AMPLITUDE = 1e-2
"""Amplitude of a line, relative to the strongest, above which it counts as excited. Heuristic."""
MAX_TRANSIENT_LINES = 2000
"""Largest number of lines of a segment with a transient; more are thinned (`thin_lines`). Chosen."""
SMOOTHING_LINES = 9
"""Number of lines over which the noise power between periods and, with a transient, the excitation power are averaged.
Chosen."""

LEAST_RUN_SHARE, MOST_RUNS = 0.5, 16
"""Least length of a run between gaps, relative to the longest of its segment, and most runs of a segment, the longest
ones: each needs an initial state of its own. Chosen."""
TAPER_POWER = 0.5
"""Mean square of a sine window: the share of a steady signal's power that it leaves."""


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
    """(lines,): whether the excitation has power there, see `LEAST_EXCITED_AMPLITUDE`."""
    transient: bool
    """Whether the spectra contain a transient, from different states at the two ends."""
    rate_hz: float
    hold: Hold


def compute_all_lines(driven_segments: Sequence[tuple[Recording, Segment]]) -> list[SegmentLines]:
    """Compute the spectra of driven segments, without those that are not excited (`compute_segment_lines`). A segment
    without a complete period gives a spectrum for each run that its gaps divide it into (`_list_runs`)."""
    return [
        lines
        for recording, segment in driven_segments
        for run in _list_runs(recording, segment)
        if (lines := compute_segment_lines(recording, run)) is not None
    ]


def _list_runs(recording: Recording, segment: Segment) -> list[Segment]:
    """List the runs of complete samples of a segment, as segments: the longest `MOST_RUNS` of at least
    `LEAST_RUN_SHARE` of the length of the longest. The segment itself where it has a complete period."""
    starts, longest = _find_whole_periods(recording, segment)
    if not starts or longest == segment.period:
        return [segment]
    is_complete = _find_complete_samples(recording)[segment.start : segment.stop]
    runs = sorted(find_runs(is_complete), key=lambda run: run[0] - run[1])[:MOST_RUNS]
    return [
        replace(segment, start=segment.start + start, stop=segment.start + stop)
        for start, stop in sorted(runs)
        if stop - start >= LEAST_RUN_SHARE * longest
    ]


def compute_segment_lines(recording: Recording, segment: Segment) -> SegmentLines | None:
    """Compute the spectra of a segment with their noise; None where its longest run without gaps has fewer than eight
    samples (chosen), or where it is not excited: the spectrum without the mean is rounding error (at most 1e-9 of the
    largest sample)."""
    starts, length = _find_whole_periods(recording, segment)
    if not starts or length < 8:
        return None
    rate_hz = recording.sample_rate_hz
    transient = length != segment.period or starts == [segment.start]
    spectra = [_compute_spectra(signal.samples, starts, length) for signal in (recording.command, recording.response)]
    excitation = recording.command if recording.excitation is None else recording.excitation
    excitation_norm = _compute_norm(_compute_spectra(excitation.samples, starts, length))
    if not excitation_norm.max() > 1e-9 * max(
        float(np.nanmax(np.abs(excitation.samples[segment.start : segment.stop]))), 1e-300
    ):
        return None
    command, response = (spectrum.mean(axis=0) for spectrum in spectra)
    if len(starts) > 1:
        noise = smooth_over_lines(compute_period_variance(spectra[1]), SMOOTHING_LINES) / len(starts)
    else:
        noise = estimate_local_noise(command, response)
    frequency_hz = np.arange(1, len(command) + 1) * rate_hz / length
    if transient:
        # A line without power between excited lines counts as excited, too; one to which power only leaks does not.
        tapered_norm = _compute_norm(_compute_spectra(excitation.samples, starts, length, tapered=True))
        excited = _find_strong_lines(_smooth(excitation_norm)) & _find_strong_lines(_smooth(tapered_norm))
    else:
        excited = _find_strong_lines(excitation_norm)
    return SegmentLines(frequency_hz, command, response, noise, excited, transient, rate_hz, recording.hold)


def _compute_norm(spectra: ComplexArray) -> FloatArray:
    """Compute the norm (lines,) over channels of the mean over periods of spectra (periods, lines, channels)."""
    return np.asarray(np.linalg.norm(spectra.mean(axis=0), axis=1))


def _smooth(norm: FloatArray) -> FloatArray:
    """Smooth magnitudes (lines,) over `SMOOTHING_LINES` lines."""
    return np.sqrt(smooth_over_lines(norm**2, SMOOTHING_LINES))


def _find_strong_lines(norm: FloatArray) -> BoolArray:
    """Find the lines (lines,) whose magnitude exceeds `LEAST_EXCITED_AMPLITUDE` of the largest."""
    return np.asarray(norm > LEAST_EXCITED_AMPLITUDE * norm.max())


def select_band(segments: Sequence[SegmentLines], band_hz: tuple[float, float] | None) -> tuple[SegmentLines, ...]:
    """Select the excited lines of the band (Hz, ends included; None: all). Periodic segments with the same lines get
    those that any of them excites; a segment with a transient keeps at most `MAX_TRANSIENT_LINES`. Segments without
    such a line are left out."""
    low_hz, high_hz = band_hz or (0.0, np.inf)
    selected_segments = []
    for segment in segments:
        shared_excited = [candidate.excited for candidate in segments if have_same_lines(segment, candidate)]
        excited = segment.excited if segment.transient else np.any(shared_excited, axis=0)
        chosen_lines = np.flatnonzero(excited & (segment.frequency_hz >= low_hz) & (segment.frequency_hz <= high_hz))
        if segment.transient:
            command_power = np.sum(np.abs(segment.command[chosen_lines]) ** 2, axis=1)
            chosen_lines = chosen_lines[thin_lines(command_power, MAX_TRANSIENT_LINES)]
        if len(chosen_lines):
            selected_segments.append(_select_lines(segment, chosen_lines))
    return tuple(selected_segments)


def thin_lines(command_power: FloatArray, max_lines: int) -> npt.NDArray[np.int64]:
    """Select at most `max_lines` of the lines: of every k consecutive ones the first with at least half of the largest
    command power among them, so that the lines of a comb are kept, which a fixed stride could miss altogether.
    command_power: (lines,). Returns their indices, in ascending order."""
    stride = max(1, -(-len(command_power) // max_lines))
    padded_power = np.append(command_power, np.zeros(-len(command_power) % stride)).reshape(-1, stride)
    is_strong = padded_power >= padded_power.max(axis=1, keepdims=True) / 2
    return np.asarray(np.arange(len(padded_power)) * stride + np.argmax(is_strong, axis=1))


def have_same_lines(first: SegmentLines, second: SegmentLines) -> bool:
    """Whether two segments have no transient and the same rate, hold and lines."""
    return (
        not (first.transient or second.transient)
        and (first.rate_hz, first.hold) == (second.rate_hz, second.hold)
        and np.array_equal(first.frequency_hz, second.frequency_hz)
    )


def _select_lines(segment: SegmentLines, chosen_lines: npt.NDArray[np.int64]) -> SegmentLines:
    """Restrict a segment to the lines with these indices (k,)."""
    return SegmentLines(
        segment.frequency_hz[chosen_lines],
        segment.command[chosen_lines],
        segment.response[chosen_lines],
        segment.noise[chosen_lines],
        segment.excited[chosen_lines],
        segment.transient,
        segment.rate_hz,
        segment.hold,
    )


def split_fit_and_test(
    recordings: Sequence[Recording],
) -> tuple[list[tuple[Recording, Segment]], list[tuple[Recording, Segment]]]:
    """Split the driven segments into those to fit and those held out for a test. Held out are the segments with the
    role "test"; where all segments or no driven ones have it, the last of more than 2 m segments (m commands), or the
    last third of a single segment that is not periodic, or of the longest part of a single recording without segments,
    else none."""
    driven_segments = [
        (recording, segment) for recording in recordings for segment in _iterate_driven_segments(recording)
    ]
    test_segments = [(recording, segment) for recording, segment in driven_segments if segment.role == "test"]
    fit_segments = [(recording, segment) for recording, segment in driven_segments if segment.role != "test"]
    if test_segments and any(segment.role != "test" for recording in recordings for segment in recording.segments):
        return fit_segments, test_segments
    if not driven_segments:
        return [], []
    fit_segments = [*driven_segments]
    if len(fit_segments) > 2 * fit_segments[0][0].command.samples.shape[1]:
        return fit_segments[:-1], fit_segments[-1:]
    lengths = [segment.stop - segment.start for _, segment in fit_segments]
    recording, longest = fit_segments.pop(lengths.index(max(lengths)))
    is_alone = not fit_segments or (len(recordings) == 1 and not recording.segments)
    if not is_alone or longest.period:
        return driven_segments, []
    split_sample = longest.start + 2 * (longest.stop - longest.start) // 3
    fit_part = replace(longest, stop=split_sample, role="fit")
    test_part = replace(longest, start=split_sample, role="test")
    return [*fit_segments, (recording, fit_part)], [(recording, test_part)]


def _iterate_driven_segments(recording: Recording) -> Iterator[Segment]:
    """Iterate over the segments (`list_segments`) other than rest and free decay."""
    for segment in list_segments(recording):
        if segment.kind not in ("rest", "free"):
            yield segment


def _find_whole_periods(recording: Recording, segment: Segment) -> tuple[list[int], int]:
    """Find start samples and common length of the complete periods, without the segment's first period where there are
    others; without a complete period, or for a period of fewer than eight samples, start and length of the longest run
    of samples without gaps. Lists no start where every sample is missing."""
    is_complete = _find_complete_samples(recording)
    if segment.period >= 8:
        starts = range(segment.start, segment.stop - segment.period + 1, segment.period)
        complete_starts = [start for start in starts if is_complete[start : start + segment.period].all()]
        period_starts = [start for start in complete_starts if start != segment.start] or complete_starts
        if period_starts:
            return period_starts, segment.period
    gap_indices = np.flatnonzero(~np.concatenate([[False], is_complete[segment.start : segment.stop], [False]]))
    longest_run = int(np.argmax(np.diff(gap_indices)))
    start, length = segment.start + int(gap_indices[longest_run]), int(np.diff(gap_indices)[longest_run]) - 1
    return ([start] if length > 0 else []), length


def _find_complete_samples(recording: Recording) -> BoolArray:
    """Find (n,): whether command, response and, where it was recorded, excitation have no missing value."""
    signals = [recording.command.samples, recording.response.samples]
    if recording.excitation is not None:
        signals.append(recording.excitation.samples)
    return np.asarray(np.all([np.isfinite(samples).all(axis=1) for samples in signals], axis=0))


def _compute_spectra(samples: FloatArray, starts: Sequence[int], length: int, tapered: bool = False) -> ComplexArray:
    """Compute the spectra (periods, lines, channels) of the samples without the mean of each period, one period per
    start. tapered: whether to apply a sine window, so that ends that differ are no excitation of all lines (leakage);
    not where that would remove most of the power, such as that of a pulse near an end. (A Hann window would remove the
    lines at both ends of a sweep.) Those of a constant channel are exactly 0."""
    periods = np.stack([samples[start : start + length] - samples[start] for start in starts])
    centred_periods = periods - periods.mean(axis=1, keepdims=True)
    if tapered:
        window = np.sin(np.pi * (np.arange(length)[:, None] + 0.5) / length)
        tapered_periods = (periods - np.sum(window * periods, axis=1, keepdims=True) / window.sum()) * window
        if np.sum(tapered_periods**2) > TAPER_POWER / 2 * np.sum(centred_periods**2):
            return compute_line_spectra(tapered_periods)
    return compute_line_spectra(centred_periods)
