"""Periodicity checks of a recording: declared periods, detection of an undeclared period, and noise between periods."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from analysis.diagnosis.data.find_segments import find_designed_command, find_period
from analysis.diagnosis.noise.periods import find_settled_periods, stack_periods
from analysis.look.channels import Stretch, compute_rms
from analysis.look.check import Check
from analysis.wording import conjoin, typeset
from equalizer.signals.recording import Recording, Segment
from equalizer.signals.signal import FloatArray

CHECK_NAME = "repeats"
ACCEPTED_DIFFERENCE, WRONG_DIFFERENCE = 0.02, 0.2
"""Limits of the relative difference (`_check_period`) of the excitation between declared periods: up to the first the
period is accepted, above the second it is an error, in between a notice is given. Heuristic."""
NOTABLE_NOISE = 0.3
"""Rms noise of a channel between repeats, as a share of its mean period's rms, above which a notice is given.
Heuristic."""


@dataclass(frozen=True, slots=True)
class RepeatNoise:
    """Noise between the periods of one segment: standard deviation about the mean period."""

    segment: int
    """Number of the segment, from 1; 0 where the period was detected and not declared."""
    period: int
    """Length in samples."""
    periods: int
    """Number of periods compared."""
    settled: bool
    """Whether the transient before the first period had decayed."""
    share: tuple[float, ...]
    """Standard deviation between repeats over that of the mean period in time, per response channel; 0 where the
    mean period is constant."""


@dataclass(frozen=True, slots=True)
class Repeats:
    """A period that was detected but not declared, and the noise between repeats."""

    undeclared_period: int
    """Length (samples) of a detected period that was not declared; 0: none."""
    period_range: Stretch
    """First and end sample of the range in which that period was detected; (0, 0) without one."""
    noise: tuple[RepeatNoise, ...]
    """Noise of each segment that repeats; empty where nothing repeats."""


def find_repeats(recording: Recording, stretches: Sequence[Stretch]) -> Repeats:
    """Compute the noise between repeats of declared periods. Where none is declared, a period is searched for in the
    longest segment, then in the longest stretch."""
    if any(segment.period for segment in recording.segments):
        return Repeats(0, (0, 0), _compute_repeat_noise(recording, declared=True))
    segment_ranges = [(segment.start, segment.stop) for segment in recording.segments]
    # A segment that was split for a test may hold less than two periods: the stretches are searched as well.
    for ranges in (segment_ranges, list(stretches)):
        start, stop = max(ranges, key=lambda sample_range: sample_range[1] - sample_range[0], default=(0, 0))
        if period := find_period(find_designed_command(recording).samples[start:stop]):
            with_period = replace(recording, segments=(Segment(start, stop, "multisine", 0.0, period),))
            return Repeats(period, (start, stop), _compute_repeat_noise(with_period, declared=False))
    return Repeats(0, (0, 0), ())


def _compute_repeat_noise(recording: Recording, *, declared: bool) -> tuple[RepeatNoise, ...]:
    """Compute the noise of each segment with two periods or more after its transient. declared: whether the periods are
    those that the recording declares."""
    noises = []
    for periods in find_settled_periods(recording):
        if periods.count < 2:
            continue
        stacked_periods = stack_periods(recording.response.samples, periods)
        mean_period = stacked_periods.mean(axis=0)
        rms_between_repeats = np.sqrt(
            np.sum((stacked_periods - mean_period) ** 2, axis=(0, 1)) / ((periods.count - 1) * periods.length)
        )
        mean_period_rms = np.array([compute_rms(column) for column in mean_period.T])
        share = tuple((rms_between_repeats / np.where(mean_period_rms > 0, mean_period_rms, np.inf)).tolist())
        segment_number = periods.index + 1 if declared else 0
        noises.append(RepeatNoise(segment_number, periods.length, periods.count, periods.settled, share))
    return tuple(noises)


def check_repeats(recording: Recording, repeats: Repeats) -> tuple[Check, ...]:
    """Check the declared periods, an undeclared period, and the noise between repeats. Where nothing repeats and no
    period is objected to, a single notice says so."""
    checks = [check for check in _check_periods(recording) if check is not None]
    if repeats.undeclared_period:
        repeat_count = (repeats.period_range[1] - repeats.period_range[0]) / repeats.undeclared_period
        checks.append(
            Check(
                CHECK_NAME,
                "notice",
                f"The excitation repeats every {repeats.undeclared_period} samples "
                f"({repeats.undeclared_period / recording.sample_rate_hz:.4g} s), {repeat_count:.3g} times, but no "
                "segment says so.",
                f"State period = {repeats.undeclared_period} in its segment: repetition separates noise "
                "from distortion.",
            )
        )
    if repeats.noise:
        checks += _check_noise(recording, repeats.noise)
    elif not checks:
        sentence = "Nothing repeats, so noise cannot be distinguished from errors of a model."
        checks.append(Check(CHECK_NAME, "notice", sentence, "Record some periods more than once."))
    return tuple(checks)


def _check_noise(recording: Recording, noise: Sequence[RepeatNoise]) -> tuple[Check, ...]:
    """Check the noise between repeats, per channel, in the segment where it is smallest."""
    channels = recording.response.channels
    shares = np.array([segment_noise.share for segment_noise in noise])
    sentence = conjoin([f"{typeset(f'{100 * shares[:, k].min():.2g}')} % of {name}" for k, name in enumerate(channels)])
    noisy_channels = [name for k, name in enumerate(channels) if shares[:, k].min() > NOTABLE_NOISE]
    text = (
        "The rms deviation of single periods from their mean (up to "
        f"{max(segment_noise.periods for segment_noise in noise)} periods) is at least {sentence}."
    )
    advice = (
        f"{conjoin(noisy_channels)} hardly repeat: average more periods, or drive the device more strongly."
        if noisy_channels
        else ""
    )
    return (Check(CHECK_NAME, "notice" if noisy_channels else "fine", text, advice),)


def _check_periods(recording: Recording) -> list[Check | None]:
    """Check the declared periods of segments of at least two periods, by the difference of the excitation (the command
    where no excitation varies) from period to period."""
    return [
        _check_period(find_designed_command(recording).samples[segment.start : segment.stop], segment, number)
        for number, segment in enumerate(recording.segments, start=1)
        if segment.period and segment.stop - segment.start >= 2 * segment.period
    ]


def _check_period(command: FloatArray, segment: Segment, number: int) -> Check | None:
    """Check a declared period; None where it is accepted. The relative difference is the rms of command[n + period] -
    command[n], divided by sqrt(2) and by the rms of the command: 1 for a period at which the command is
    uncorrelated."""
    command_rms = compute_rms(command[np.isfinite(command).all(axis=1)])
    difference = command[segment.period :] - command[: -segment.period]
    relative_difference = float(np.sqrt(np.nanmean(difference**2) / 2)) / command_rms if command_rms > 0 else 0.0
    if relative_difference <= ACCEPTED_DIFFERENCE:
        return None
    return Check(
        CHECK_NAME,
        "wrong" if relative_difference > WRONG_DIFFERENCE else "notice",
        f"Segment {number} states a period of {segment.period} samples, but its excitation differs by "
        f"{relative_difference:.1%} from one period to the next.",
        "Correct the period, or set it to 0.",
    )
