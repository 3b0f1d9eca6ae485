"""Experiments in a recording: spectra of whole periods, or of windows where the excitation is not periodic.

An experiment is an excitation that is repeated over one or more periods, or a window. Spectra are rfft / length without
the lines at zero and at half the sample rate, so that white noise of variance s² has the expected power s² / length at
each line; windows are scaled to a mean square of 1 for the same reason.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from equalizer.signals.recording import Recording, Segment, list_segments
from equalizer.signals.signal import ComplexArray, FloatArray
from equalizer.signals.spectral_density import compute_line_spectra, hann

BROADBAND_KINDS = ("sweep", "multisine", "noise", "binary")
"""Kinds of segments whose periods are used as experiments."""
TRANSIENT_S = 5.0
"""Assumed length of a transient (s): ten time constants of 0.5 s, the ordinary decay bound of a state-space model
(`ORDINARY_DECAY_S`), after which e^-10 of it remains."""
_DRIVEN_KINDS = (*BROADBAND_KINDS, "sine", "slow", "step", "impact")
"""Kinds of segments over which windows are averaged where no excitation is periodic."""


@dataclass(frozen=True, slots=True, eq=False)
class Experiment:
    """Spectra (rfft / length) of an excitation's periods, or of a single window."""

    length: int
    """Number of samples of one period: line k (from 1 on) lies at k rate / length."""
    command: ComplexArray
    """(periods, lines, inputs)"""
    response: ComplexArray
    """(periods, lines, outputs)"""
    instrument: ComplexArray
    """(periods, lines, inputs): the excitation, where it was recorded, else the command."""
    replaced_share: float = 0.0
    """Share of the last period's samples that were replaced by the mean of the other periods."""

    @property
    def periods(self) -> int:
        """Number of periods; 1 for a window."""
        return len(self.command)

    @property
    def effective_periods(self) -> float:
        """Effective number of periods: independent periods whose mean would have the same variance."""
        if not self.replaced_share:
            return float(self.periods)
        return 1 / ((1 - self.replaced_share) / self.periods + self.replaced_share / (self.periods - 1))

    @property
    def observed_noise_share(self) -> float:
        """Share of the noise power that differs between periods."""
        if not self.replaced_share:
            return 1.0
        return 1 - self.replaced_share / (self.periods - 1)


@dataclass(frozen=True, slots=True, eq=False)
class ExperimentSet:
    """All experiments of some recordings."""

    experiments: tuple[Experiment, ...]
    remarks: tuple[str, ...]
    """Sentences for the user on periods that were left out, transients that were kept, and windows."""
    periodic: bool
    """Whether the experiments are whole periods (True) or windows (False)."""


def select_instrument_signal(recording: Recording) -> FloatArray:
    """Select the instrument (n, inputs) of the estimate: the excitation where it was recorded, else the command."""
    return (recording.command if recording.excitation is None else recording.excitation).samples


def collect_periodic_experiments(recordings: Sequence[Recording]) -> ExperimentSet:
    """Collect the whole periods of every periodic broadband segment without the role "test". The first period counts
    only if there is no other, or, where a period lasts at least twice `TRANSIENT_S`, with its transient replaced
    (`replaced_share`). Periods with missing samples and periods of less than four samples (chosen) are left out."""
    experiments: list[Experiment] = []
    single_period_segments, missing_periods = 0, 0
    for recording in recordings:
        for segment in recording.segments:
            if segment.kind not in BROADBAND_KINDS or segment.period < 4 or segment.role == "test":
                continue
            starts = range(segment.start, segment.stop - segment.period + 1, segment.period)
            complete_starts = [start for start in starts if _has_all_samples(recording, start, segment.period)]
            missing_periods += len(starts) - len(complete_starts)
            period_starts = [start for start in complete_starts if start != segment.start] or complete_starts
            single_period_segments += period_starts == [segment.start]
            if period_starts:
                experiment = _make_experiment(recording, period_starts, segment.period, np.ones(segment.period))
                transient_samples = round(TRANSIENT_S * recording.sample_rate_hz)
                add_first = (
                    segment.start in complete_starts
                    and period_starts != complete_starts
                    and segment.period >= 2 * transient_samples
                )
                experiments.append(
                    _add_first_period(recording, experiment, period_starts, segment.start, transient_samples)
                    if add_first
                    else experiment
                )
    remarks = []
    if single_period_segments:
        remarks.append(
            f"{_format_segments(single_period_segments)} had one usable period only: it was kept, with its transient."
        )
    if missing_periods:
        remarks.append(f"{_format_periods(missing_periods)} left out because of missing samples.")
    return ExperimentSet(tuple(experiments), tuple(remarks), periodic=True)


def collect_window_experiments(recordings: Sequence[Recording], window_s: float) -> ExperimentSet:
    """Collect Hann windows of window_s seconds (at least 8 samples, chosen), overlapping by half, over all driven
    segments without the role "test" or, without segments, over each part. Windows with missing samples are left
    out."""
    experiments: list[Experiment] = []
    for recording in recordings:
        length = max(8, round(window_s * recording.sample_rate_hz))
        window = hann(length)
        window = window / np.sqrt(np.mean(window**2))
        for segment in _select_driven_segments(recording):
            starts = range(segment.start, segment.stop - length + 1, length // 2)
            complete_starts = [start for start in starts if _has_all_samples(recording, start, length)]
            # Windows, unlike periods, do not contain the same excitation: each is a separate experiment.
            experiments += [_make_experiment(recording, [start], length, window) for start in complete_starts]
    remark = f"No periodic excitation: averaged over Hann windows of {window_s:g} s (H1), which blur narrow resonances."
    return ExperimentSet(tuple(experiments), (remark,), periodic=False)


def _select_driven_segments(recording: Recording) -> list[Segment]:
    """Select the driven segments (`list_segments`) without the role "test"."""
    return [segment for segment in list_segments(recording) if segment.kind in _DRIVEN_KINDS and segment.role != "test"]


def _has_all_samples(recording: Recording, start: int, length: int) -> bool:
    """Whether no sample of command, response and excitation is missing (NaN) from `start` on, for `length` samples."""
    sample_range = slice(start, start + length)
    signals = (recording.command.samples, recording.response.samples, select_instrument_signal(recording))
    return all(bool(np.isfinite(samples[sample_range]).all()) for samples in signals)


def _make_experiment(recording: Recording, starts: Sequence[int], length: int, window: FloatArray) -> Experiment:
    """Compute the spectra of the periods that begin at `starts`, without their mean. window: (length,), mean square
    1."""

    def compute_spectra(samples: FloatArray) -> ComplexArray:
        """Compute the spectra (periods, lines, channels) of all periods of samples (n, channels)."""
        periods = np.stack([samples[start : start + length] for start in starts])
        return compute_line_spectra((periods - periods.mean(axis=1, keepdims=True)) * window[:, None])

    return Experiment(
        length,
        compute_spectra(recording.command.samples),
        compute_spectra(recording.response.samples),
        compute_spectra(select_instrument_signal(recording)),
    )


def _add_first_period(
    recording: Recording, experiment: Experiment, period_starts: Sequence[int], first_start: int, transient_samples: int
) -> Experiment:
    """Add the first period, its first `transient_samples` samples (the transient) replaced by the mean of the other
    periods: for a linear plant, command and response are then those of the steady state throughout. first_start: index
    of its start; period_starts: starts of the other periods."""

    def compute_spectra(samples: FloatArray) -> ComplexArray:
        """Compute the spectrum (1, lines, channels) of the completed first period of samples (n, channels)."""
        period = samples[first_start : first_start + experiment.length].copy()
        period[:transient_samples] = np.mean(
            [samples[start : start + transient_samples] for start in period_starts], axis=0
        )
        spectrum = (
            np.fft.rfft(period - period.mean(axis=0), axis=0)[1 : (experiment.length + 1) // 2] / experiment.length
        )
        return np.asarray(spectrum[None], dtype=np.complex128)

    return Experiment(
        experiment.length,
        np.concatenate([experiment.command, compute_spectra(recording.command.samples)]),
        np.concatenate([experiment.response, compute_spectra(recording.response.samples)]),
        np.concatenate([experiment.instrument, compute_spectra(select_instrument_signal(recording))]),
        replaced_share=transient_samples / experiment.length,
    )


def _format_segments(count: int) -> str:
    """Format a number of segments as the beginning of a remark."""
    return "One segment" if count == 1 else f"{count} segments"


def _format_periods(count: int) -> str:
    """Format a number of periods, with its verb, as the beginning of a remark."""
    return "One period was" if count == 1 else f"{count} periods were"
