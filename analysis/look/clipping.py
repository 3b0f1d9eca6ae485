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
from analysis.look.check import Check, fine_if_none
from equalizer.signals.signal import FloatArray, runs_of

CLIPPING = "clipping"
LEAST_SAMPLES = 5
"""Fewest samples at an extreme; fewer may lie there by chance. Also the length from which a single run suffices."""
LEAST_RUNS = 2
"""Fewest different runs of equal readings at the top that count as clipping, unless a run has `LEAST_SAMPLES`."""
_STEPS = 3.0
"""Least extrapolated rise beyond the extreme, in steps of rounding."""
SETTLES = 0.4
"""Share of its earlier slope that a signal must keep until a flat run begins: with less it comes to rest by itself."""
_FEW_VALUES = 24
"""Channels with no more distinct values are not checked: a binary command, a series of steps, a coarse encoder."""
_CROWDED = 4.0
"""Least ratio of the samples at the extreme to those in the next bin below it, one rounding step wide or wider."""


def check_clipping(channels: Sequence[Channel]) -> tuple[Check, ...]:
    """A check of each clipped channel, without excitations; a single "fine" check where no channel is clipped."""
    found = tuple(check for channel in channels if channel.role != "excitation" for check in _channel_checks(channel))
    return fine_if_none(CLIPPING, found, "No channel is flat at its extremes.")


def _channel_checks(channel: Channel) -> tuple[Check, ...]:
    """The check of a channel that is clipped at either end; empty for others. A clipped command is only a notice."""
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
    """Number of clipped samples at the upper end; 0 where the signal reverses there by itself. samples: (n,), NaN =
    missing, at least one known."""
    filled = np.where(np.isfinite(samples), samples, -np.inf)
    top = float(filled.max())
    known = samples[np.isfinite(samples)]
    step = rounding_step(samples)
    width = max(step, 1e-3 * float(np.ptp(known)))
    tolerance = max(0.5 * step, 1e-9 * float(np.ptp(known)))
    at_top = filled >= top - tolerance
    # The next bin is at least one rounding step wide, so that a rounded signal is compared value by value.
    next_below = int(np.sum((filled < top - tolerance) & (filled >= top - tolerance - width)))
    if at_top.sum() < LEAST_SAMPLES or at_top.sum() < _CROWDED * next_below:
        return 0
    runs = runs_of(at_top)
    beyond = [_extrapolate_rise(filled, start, stop) for start, stop in runs]
    needed = max(_STEPS * step, 1e-6 * float(np.ptp(known)))
    counted = [stop - start for (start, stop), over in zip(runs, beyond, strict=True) if over > needed]
    # A periodic signal returns to its peak along the same samples: its equal runs count once.
    ways = {_run_signature(filled, run, needed) for run, over in zip(runs, beyond, strict=True) if over > needed}
    return int(at_top.sum()) if len(ways) >= LEAST_RUNS or max(counted, default=0) >= LEAST_SAMPLES else 0


def _run_signature(samples: FloatArray, run: tuple[int, int], step: float) -> tuple[float, ...]:
    """Length of a flat run, and the sample on either side of it in multiples of `step`, sorted: equal for the runs of a
    periodic signal."""
    start, stop = run
    beside = sorted((round(float(samples[start - 1]) / step), round(float(samples[stop]) / step)))
    return (stop - start, *beside)


def _extrapolate_rise(samples: FloatArray, start: int, stop: int) -> float:
    """Rise s T / 4 of the signal above a flat run, in its unit, with the lesser slope of both sides as s. 0 at the ends
    of a recording, next to missing samples, and where the signal comes to rest before the run (`SETTLES`)."""
    back = max(1, (stop - start) // 8)  # several samples, since a slow rounded signal repeats each value
    if start - 1 < 2 * back or stop + back >= len(samples):
        return 0.0
    before, earlier = samples[start - 1 - back], samples[start - 1 - 2 * back]
    came, went = samples[start - 1] - before, samples[stop] - samples[stop + back]
    if not np.isfinite(came + went + earlier) or came < SETTLES * (before - earlier):
        return 0.0
    slope = min(came, went) / back
    return float(max(0.0, slope) * (stop - start + 1) / 4)
