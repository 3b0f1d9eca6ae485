"""Detection of clipping: flat extremes at the limit of a sensor, a converter or an amplifier.

A signal that reverses by itself is slow there, so it stays near its extreme no longer than its slope before and after
allows. A clipped one arrives fast, stays at the last value, and leaves fast: by its slopes and the time at the extreme,
it would have risen further by slope x time / 4 (a parabola through both).
"""

from collections.abc import Sequence

import numpy as np

from analysis.diagnosis.noise.rounding import rounding_step
from analysis.look.channels import Channel
from analysis.look.check import Check, fine_if_none
from equalizer.signals.signal import FloatArray, runs_of

CLIPPING = "clipping"
LEAST_SAMPLES = 5
"""Samples at an extreme below which they are chance."""
LEAST_RUNS = 2
"""Fewest runs of equal readings at the top that count as clipping."""
_STEPS = 3.0
"""Least extrapolated rise beyond the extreme, in steps of rounding."""
SETTLES = 0.4
"""Share of its earlier speed that a signal must keep until it is flat: with less it comes to rest by itself."""
_FEW_VALUES = 24
"""Channels with no more distinct values are not checked: a binary command, a series of steps, a coarse encoder."""
_CROWDED = 4.0
"""Samples at the extreme over those in the next equally wide bin below it."""


def check_clipping(channels: Sequence[Channel]) -> tuple[Check, ...]:
    """A check of each clipped channel, excitations left out; a single "fine" check where none is clipped."""
    found = tuple(check for channel in channels if channel.role != "excitation" for check in _channel_checks(channel))
    return fine_if_none(CLIPPING, found, "No channel is flat at its extremes.")


def _channel_checks(channel: Channel) -> tuple[Check, ...]:
    if len(np.unique(channel.known)) <= _FEW_VALUES:
        return ()
    sides = [(sign, count_clipped_samples(sign * channel.samples)) for sign in (1.0, -1.0)]
    hit = [(sign, count) for sign, count in sides if count]
    if not hit:
        return ()
    ends = " and ".join(channel.format(sign * float(np.max(sign * channel.known))) for sign, _ in hit)
    count = sum(count for _, count in hit)
    text = f"{channel.label} is cut off at {ends}: {count} samples ({count / len(channel.samples):.2%}) lie there."
    if channel.role == "command":
        return (Check(CLIPPING, "notice", text, "The command was limited: leave those stretches out, or drive less."),)
    return (
        Check(CLIPPING, "wrong", text, "Record again with less drive or a wider range; leave those stretches out."),
    )


def count_clipped_samples(samples: FloatArray) -> int:
    """Clipped samples at the upper end; 0 where the signal reverses there by itself. samples: (n,), NaN = missing."""
    filled = np.where(np.isfinite(samples), samples, -np.inf)
    top = float(filled.max())
    known = samples[np.isfinite(samples)]
    step = rounding_step(samples)
    width = max(step, 1e-3 * float(np.ptp(known)))
    tolerance = max(0.5 * step, 1e-9 * float(np.ptp(known)))
    at_top = filled >= top - tolerance
    # With the bin width of the top value, so that a rounded signal is compared step by step.
    next_below = int(np.sum((filled < top - tolerance) & (filled >= top - tolerance - width)))
    if at_top.sum() < LEAST_SAMPLES or at_top.sum() < _CROWDED * next_below:
        return 0
    runs = runs_of(at_top)
    beyond = [_extrapolate_rise(filled, start, stop) for start, stop in runs]
    needed = max(_STEPS * step, 1e-6 * float(np.ptp(known)))
    counted = [stop - start for (start, stop), over in zip(runs, beyond, strict=True) if over > needed]
    # A periodic signal comes back to its peak again and again, by the same way: that is one run.
    ways = {_run_signature(filled, run, needed) for run, over in zip(runs, beyond, strict=True) if over > needed}
    return int(at_top.sum()) if len(ways) >= LEAST_RUNS or max(counted, default=0) >= LEAST_SAMPLES else 0


def _run_signature(samples: FloatArray, run: tuple[int, int], step: float) -> tuple[float, ...]:
    """Length of a flat run, and the samples on either side in steps, sorted: equal for runs of a periodic signal."""
    start, stop = run
    beside = sorted((round(float(samples[start - 1]) / step), round(float(samples[stop]) / step)))
    return (stop - start, *beside)


def _extrapolate_rise(samples: FloatArray, start: int, stop: int) -> float:
    """Extrapolated rise of the signal above a flat run; 0 at the ends of a recording."""
    back = max(1, (stop - start) // 8)  # a rounded signal stands still between its steps, so not by two samples alone
    if start - 1 < 2 * back or stop + back >= len(samples):
        return 0.0
    before, earlier = samples[start - 1 - back], samples[start - 1 - 2 * back]
    came, went = samples[start - 1] - before, samples[stop] - samples[stop + back]
    if not np.isfinite(came + went + earlier) or came < SETTLES * (before - earlier):
        return 0.0
    slope = min(came, went) / back
    return float(max(0.0, slope) * (stop - start + 1) / 4)
