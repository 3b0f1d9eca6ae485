"""Detection of clipping: flat extremes at the limit of a sensor, a converter or an amplifier.

A signal that reverses by itself slows down before its extreme, so its time near the extreme is short for its slope. A
clipped signal reaches the limit fast, keeps that value, and leaves it fast. A parabola that crosses the limit with the
slopes s and -s, a time T apart, peaks s T / 4 above it: a run of equal readings counts as clipped where this
extrapolated rise exceeds a few rounding steps. Several different runs, or a long one, are needed.
"""

from collections.abc import Sequence

import numpy as np

from analysis.diagnosis.noise.rounding import rounding_step
from analysis.look.channels import Channel
from analysis.look.check import Check, add_fine_if_none
from equalizer.signals.signal import FloatArray, find_runs

CLIPPING = "clipping"
LEAST_SAMPLES = 5
"""Fewest samples at an extreme; fewer may lie there by chance. Also the length from which a single run suffices."""
LEAST_RUNS = 2
"""Fewest different runs of equal readings at the top that count as clipping, unless a run has `LEAST_SAMPLES`."""
_STEPS = 3.0
"""Least extrapolated rise beyond the extreme, in steps of rounding."""
SETTLING_SHARE = 0.4
"""Share of its earlier slope that a signal must keep until a flat run begins: with less it comes to rest by itself."""
_FEW_VALUES = 24
"""Channels with no more distinct values are not checked: a binary command, a series of steps, a coarse encoder."""
_LEAST_CROWDING = 4.0
"""Least ratio of the samples at the extreme to those in the next bin below it, one rounding step wide or wider."""


def check_clipping(channels: Sequence[Channel]) -> tuple[Check, ...]:
    """A check of each clipped channel, without excitations; a single "fine" check where no channel is clipped."""
    checks = tuple(check for channel in channels if channel.role != "excitation" for check in _channel_checks(channel))
    return add_fine_if_none(CLIPPING, checks, "No channel is flat at its extremes.")


def _channel_checks(channel: Channel) -> tuple[Check, ...]:
    """The check of a channel that is clipped at either end; empty for others. A clipped command is only a notice."""
    if len(np.unique(channel.finite_samples)) <= _FEW_VALUES:
        return ()
    counts_by_sign = [(sign, count_clipped_samples(sign * channel.samples)) for sign in (1.0, -1.0)]
    clipped_ends = [(sign, count) for sign, count in counts_by_sign if count]
    if not clipped_ends:
        return ()
    ends = " and ".join(channel.format(sign * float(np.max(sign * channel.finite_samples))) for sign, _ in clipped_ends)
    count = sum(count for _, count in clipped_ends)
    text = f"{channel.label} is cut off at {ends}: {count} samples ({count / len(channel.samples):.2%}) lie there."
    if channel.role == "command":
        return (Check(CLIPPING, "notice", text, "The command was limited: leave those stretches out, or drive less."),)
    return (
        Check(CLIPPING, "wrong", text, "Record again with less drive or a wider range; leave those stretches out."),
    )


def count_clipped_samples(samples: FloatArray) -> int:
    """Number of clipped samples at the upper end; 0 where the signal reverses there by itself. samples: (n,), NaN =
    missing, at least one known."""
    gap_free = np.where(np.isfinite(samples), samples, -np.inf)
    top = float(gap_free.max())
    finite = samples[np.isfinite(samples)]
    step = rounding_step(samples)
    width = max(step, 1e-3 * float(np.ptp(finite)))
    tolerance = max(0.5 * step, 1e-9 * float(np.ptp(finite)))
    at_top = gap_free >= top - tolerance
    # The next bin is at least one rounding step wide, so that a rounded signal is compared value by value.
    next_below = int(np.sum((gap_free < top - tolerance) & (gap_free >= top - tolerance - width)))
    if at_top.sum() < LEAST_SAMPLES or at_top.sum() < _LEAST_CROWDING * next_below:
        return 0
    runs = find_runs(at_top)
    rises = [_extrapolate_rise(gap_free, start, stop) for start, stop in runs]
    least_rise = max(_STEPS * step, 1e-6 * float(np.ptp(finite)))
    run_lengths = [stop - start for (start, stop), rise in zip(runs, rises, strict=True) if rise > least_rise]
    # A periodic signal returns to its peak along the same samples: its equal runs count once.
    signatures = {
        _run_signature(gap_free, run, least_rise) for run, rise in zip(runs, rises, strict=True) if rise > least_rise
    }
    return int(at_top.sum()) if len(signatures) >= LEAST_RUNS or max(run_lengths, default=0) >= LEAST_SAMPLES else 0


def _run_signature(samples: FloatArray, run: tuple[int, int], step: float) -> tuple[float, ...]:
    """Length of a flat run, and the sample on either side of it in multiples of `step`, sorted: equal for the runs of a
    periodic signal."""
    start, stop = run
    neighbours = sorted((round(float(samples[start - 1]) / step), round(float(samples[stop]) / step)))
    return (stop - start, *neighbours)


def _extrapolate_rise(samples: FloatArray, start: int, stop: int) -> float:
    """Rise s T / 4 of the signal above a flat run, in its unit, with the lesser slope of both sides as s. 0 at the ends
    of a recording, next to missing samples, and where the signal comes to rest before the run (`SETTLING_SHARE`)."""
    offset = max(1, (stop - start) // 8)  # several samples, since a slow rounded signal repeats each value
    if start - 1 < 2 * offset or stop + offset >= len(samples):
        return 0.0
    preceding, earlier = samples[start - 1 - offset], samples[start - 1 - 2 * offset]
    rise, fall = samples[start - 1] - preceding, samples[stop] - samples[stop + offset]
    if not np.isfinite(rise + fall + earlier) or rise < SETTLING_SHARE * (preceding - earlier):
        return 0.0
    slope = min(rise, fall) / offset
    return float(max(0.0, slope) * (stop - start + 1) / 4)
