"""Periodicity: checks of declared periods, detection of an undeclared one, and the noise between repeats."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from analysis.diagnosis.data.found_segments import find_designed_command, find_period
from analysis.diagnosis.noise.periods import find_settled_periods, period_samples
from analysis.look.channels import Stretch, rms
from analysis.look.check import Check
from analysis.wording import conjoin, typeset
from equalizer.signals.recording import Recording, Segment
from equalizer.signals.signal import FloatArray

REPEATS = "repeats"
SAME, UNLIKE = 0.02, 0.2
"""Rms difference of the command between declared periods, as a share of its rms: up to the first the period is right,
above the second it is wrong, a doubt between."""
LOUD = 0.3
"""Rms noise of a channel between repeats, as a share of its mean period's rms, above which a notice is given."""


@dataclass(frozen=True, slots=True)
class RepeatNoise:
    """Noise between the periods of one segment: rms deviation from the mean period."""

    segment: int
    """From 1; 0 where the period was found and not declared."""
    period: int
    """Length in samples."""
    periods: int
    """Number of periods compared."""
    settled: bool
    """Whether the transient before the first period had decayed."""
    share: tuple[float, ...]
    """Rms between repeats over rms of the mean period, per response channel."""


@dataclass(frozen=True, slots=True)
class Repeats:
    """A period that was detected but not declared, and the noise between repeats."""

    found: int
    """Samples of a period that was not declared; 0 = none."""
    found_in: Stretch
    noise: tuple[RepeatNoise, ...]


def find_repeats(recording: Recording, stretches: Sequence[Stretch]) -> Repeats:
    """Noise between repeats of declared periods. Where none is declared, a period is sought in the longest segment,
    then in the longest stretch."""
    if any(segment.period for segment in recording.segments):
        return Repeats(0, (0, 0), _noise_between_repeats(recording, declared=True))
    marked = [(segment.start, segment.stop) for segment in recording.segments]
    for places in (marked, list(stretches)):  # a segment that was split for a test may hold less than two periods
        start, stop = max(places, key=lambda place: place[1] - place[0], default=(0, 0))
        if period := find_period(find_designed_command(recording).samples[start:stop]):
            as_said = replace(recording, segments=(Segment(start, stop, "multisine", 0.0, period),))
            return Repeats(period, (start, stop), _noise_between_repeats(as_said, declared=False))
    return Repeats(0, (0, 0), ())


def _noise_between_repeats(recording: Recording, *, declared: bool) -> tuple[RepeatNoise, ...]:
    found = []
    for periods in find_settled_periods(recording):
        if periods.count < 2:
            continue
        by_period = period_samples(recording.response.samples, periods)
        mean = by_period.mean(axis=0)
        between = np.sqrt(np.sum((by_period - mean) ** 2, axis=(0, 1)) / ((periods.count - 1) * periods.length))
        sizes = np.array([rms(column) for column in mean.T])
        share = tuple((between / np.where(sizes > 0, sizes, np.inf)).tolist())
        number = periods.index + 1 if declared else 0
        found.append(RepeatNoise(number, periods.length, periods.count, periods.settled, share))
    return tuple(found)


def repeat_checks(recording: Recording, repeats: Repeats) -> tuple[Check, ...]:
    """Checks of declared periods, of an undeclared period, and of the noise between repeats; a notice where nothing
    repeats."""
    wrong = [check for check in _period_checks(recording) if check is not None]
    if repeats.found:
        times = (repeats.found_in[1] - repeats.found_in[0]) / repeats.found
        wrong.append(
            Check(
                REPEATS,
                "notice",
                f"The command repeats every {repeats.found} samples "
                f"({repeats.found / recording.sample_rate_hz:.4g} s), {times:.3g} times, but no segment says so.",
                f"State period = {repeats.found} in its segment: repetition separates noise from distortion.",
            )
        )
    if not repeats.noise:
        none = "Nothing repeats, so noise cannot be distinguished from errors of a model."
        wrong += [] if wrong else [Check(REPEATS, "notice", none, "Record some periods more than once.")]
        return tuple(wrong)
    return (*wrong, *_noise_checks(recording, repeats.noise))


def _noise_checks(recording: Recording, noise: Sequence[RepeatNoise]) -> tuple[Check, ...]:
    channels = recording.response.channels
    shares = np.array([each.share for each in noise])
    sentence = conjoin([f"{typeset(f'{100 * shares[:, k].min():.2g}')} % of {name}" for k, name in enumerate(channels)])
    noisy = [name for k, name in enumerate(channels) if shares[:, k].min() > LOUD]
    text = (
        f"The rms deviation of single periods from their mean (up to {max(each.periods for each in noise)} periods) is "
        f"at least {sentence}."
    )
    do = f"{conjoin(noisy)} hardly repeat: average more periods, or drive the device more strongly." if noisy else ""
    return (Check(REPEATS, "notice" if noisy else "fine", text, do),)


def _period_checks(recording: Recording) -> list[Check | None]:
    """Checks of the segments' declared periods, by the command's difference from period to period."""
    return [
        _check_period(find_designed_command(recording).samples[segment.start : segment.stop], segment, number)
        for number, segment in enumerate(recording.segments, start=1)
        if segment.period and segment.stop - segment.start >= 2 * segment.period
    ]


def _check_period(command: FloatArray, segment: Segment, number: int) -> Check | None:
    size = rms(command[np.isfinite(command).all(axis=1)])
    later = command[segment.period :] - command[: -segment.period]
    off = float(np.sqrt(np.nanmean(later**2) / 2)) / size if size > 0 else 0.0
    if off <= SAME:
        return None
    return Check(
        REPEATS,
        "wrong" if off > UNLIKE else "notice",
        f"Segment {number} states a period of {segment.period} samples, but its command differs by {off:.1%} from one "
        "period to the next.",
        "Correct the period, or set it to 0.",
    )
