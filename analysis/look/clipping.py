"""Detection of clipping: flat extremes at the limit of a sensor, a converter or an amplifier.

A signal that is not clipped has a low slope near its extreme. A clipped signal reaches the limit with a high slope,
keeps that value for a time T, and leaves it with a high slope. A parabola that crosses the limit with the slopes s and
-s, a time T apart, peaks s T / 4 above it: a run of equal readings counts as clipped where this extrapolated rise
exceeds a few rounding steps. Several different runs, or a long one, are needed. All limits below were chosen by hand.
"""

from collections.abc import Sequence

import numpy as np

from analysis.diagnosis.noise.rounding import find_rounding_step
from analysis.look.channels import Channel
from analysis.look.check import Check, add_fine_if_none
from equalizer.signals.signal import FloatArray, find_runs

CLIPPING = "clipping"
LEAST_FLAT_SAMPLES = 5
"""Fewest samples at an extreme that count as clipping; also the least length of a run that suffices alone."""
LEAST_FLAT_RUNS = 2
"""Fewest different runs of equal readings at an extreme that count as clipping, unless one has `LEAST_FLAT_SAMPLES`."""
_LEAST_RISE_STEPS = 3.0
"""Extrapolated rise beyond the extreme, in rounding steps, above which a run counts as clipped."""
SETTLING_SHARE = 0.4
"""Least ratio of the slope just before a flat run to the slope before that; below it, the signal came to rest without
clipping."""
_MAX_COARSE_VALUES = 24
"""Number of distinct values up to which a channel is not checked: a binary command, a series of steps, a coarse
encoder."""
_LEAST_CROWDING = 4.0
"""Least ratio of the samples at the extreme to those in the next bin below it, one rounding step wide or wider."""


def check_clipping(channels: Sequence[Channel]) -> tuple[Check, ...]:
    """Check all channels except excitations; one check per clipped channel, or a single "fine" check where none is."""
    checks = tuple(check for channel in channels if channel.role != "excitation" for check in _check_channel(channel))
    return add_fine_if_none(CLIPPING, checks, "No channel is flat at its extremes.")


def _check_channel(channel: Channel) -> tuple[Check, ...]:
    """Check one channel for clipping at either end; empty where it is not clipped, or has at most `_MAX_COARSE_VALUES`
    values. A clipped command is a "notice", any other clipped channel is "wrong"."""
    if len(np.unique(channel.finite_samples)) <= _MAX_COARSE_VALUES:
        return ()
    counts_by_sign = [(sign, count_clipped_samples(sign * channel.samples)) for sign in (1.0, -1.0)]
    clipped_ends = [(sign, count) for sign, count in counts_by_sign if count]
    if not clipped_ends:
        return ()
    limits_text = " and ".join(
        channel.format(sign * float(np.max(sign * channel.finite_samples))) for sign, _ in clipped_ends
    )
    count = sum(count for _, count in clipped_ends)
    finding = (
        f"{channel.label} is cut off at {limits_text}: {count} samples ({count / len(channel.samples):.2%}) lie there."
    )
    if channel.role == "command":
        return (
            Check(CLIPPING, "notice", finding, "The command was limited: leave those stretches out, or drive less."),
        )
    return (
        Check(CLIPPING, "wrong", finding, "Record again with less drive or a wider range; leave those stretches out."),
    )


def count_clipped_samples(samples: FloatArray) -> int:
    """Count the samples at the maximum of a clipped signal; 0 where the signal is not clipped there, or too few samples
    lie there (`LEAST_FLAT_SAMPLES`, `_LEAST_CROWDING`). samples: (n,), NaN = missing, at least one known. Lower
    limits for signals without rounding, relative to the range: 1e-9 (equal values), 1e-6 (rise), 1e-3 (next bin)."""
    filled_samples = np.where(np.isfinite(samples), samples, -np.inf)
    maximum = float(filled_samples.max())
    finite_samples = samples[np.isfinite(samples)]
    rounding_step = find_rounding_step(samples)
    bin_width = max(rounding_step, 1e-3 * float(np.ptp(finite_samples)))
    tolerance = max(0.5 * rounding_step, 1e-9 * float(np.ptp(finite_samples)))
    is_maximum = filled_samples >= maximum - tolerance
    # The next bin is at least one rounding step wide, so that a rounded signal is compared value by value.
    next_bin_count = int(
        np.sum((filled_samples < maximum - tolerance) & (filled_samples >= maximum - tolerance - bin_width))
    )
    if is_maximum.sum() < LEAST_FLAT_SAMPLES or is_maximum.sum() < _LEAST_CROWDING * next_bin_count:
        return 0
    runs = find_runs(is_maximum)
    rises = [_extrapolate_rise(filled_samples, start, stop) for start, stop in runs]
    least_rise = max(_LEAST_RISE_STEPS * rounding_step, 1e-6 * float(np.ptp(finite_samples)))
    run_lengths = [stop - start for (start, stop), rise in zip(runs, rises, strict=True) if rise > least_rise]
    # A periodic signal returns to its peak along the same samples: its equal runs count once.
    run_signatures = {
        _compute_run_signature(filled_samples, run, least_rise)
        for run, rise in zip(runs, rises, strict=True)
        if rise > least_rise
    }
    return (
        int(is_maximum.sum())
        if len(run_signatures) >= LEAST_FLAT_RUNS or max(run_lengths, default=0) >= LEAST_FLAT_SAMPLES
        else 0
    )


def _compute_run_signature(samples: FloatArray, run: tuple[int, int], step: float) -> tuple[float, ...]:
    """Compute the length of a flat run, and the sample on either side of it in multiples of `step`, sorted: equal for
    the runs of a periodic signal."""
    start, stop = run
    neighbours = sorted((round(float(samples[start - 1]) / step), round(float(samples[stop]) / step)))
    return (stop - start, *neighbours)


def _extrapolate_rise(samples: FloatArray, start: int, stop: int) -> float:
    """Extrapolate the rise s T / 4 of the signal above a flat run, in its unit; s is the smaller slope of both sides. 0
    near the ends of a recording, next to missing samples, and where the signal comes to rest before the run
    (`SETTLING_SHARE`)."""
    offset = max(1, (stop - start) // 8)  # several samples, since a slow rounded signal repeats each value
    if start - 1 < 2 * offset or stop + offset >= len(samples):
        return 0.0
    sample_before_run, earlier_sample = samples[start - 1 - offset], samples[start - 1 - 2 * offset]
    rise, fall = samples[start - 1] - sample_before_run, samples[stop] - samples[stop + offset]
    if not np.isfinite(rise + fall + earlier_sample) or rise < SETTLING_SHARE * (sample_before_run - earlier_sample):
        return 0.0
    slope = min(rise, fall) / offset
    return float(max(0.0, slope) * (stop - start + 1) / 4)
