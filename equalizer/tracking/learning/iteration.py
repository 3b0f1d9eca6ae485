"""Iterative learning control: play, measure, correct the forces, until only noise is left.

    u <- u + beta L(band(r - y)),  L: inverse of the model

The correction is the error's share that is not noise, 1 - (noise / residual)²: nearly all of a large error, less near
the noise floor, so that noise is not learned (with a fixed gain it is, and good initial forces get worse). The gain
falls as 1, 1/2, 1/3 ... with every repeat that increased the error; the best forces are kept.

At the ends of the record nothing is corrected. An inverse that cannot act before the first row would respond to an
error there with an impulse; a handle that sticks would not move, and the impulse would grow with every repeat.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np

from equalizer.signals.signal import FloatArray
from equalizer.tracking.feedforward.band_part import band_part

Invert = Callable[[FloatArray], FloatArray]
"""Linear inverse of the device: wanted accelerations (N, p) to forces (N, m), row by row."""

SURE = 3.0
"""Standard deviations above the noise floor from which a residual is more than noise."""
WORSE, DIVERGED = 1.1, 2.0
"""Ratio of a residual to the best one: above the first, the next correction starts from the best forces again; above
the second, the iteration counts as diverging."""
LOWEST_GAIN = 0.03
"""Gains below it make no measurable change."""
EDGE_S = 0.03
"""Time over which corrections are faded at either end of the record."""


class Verdict(Enum):
    """Decision after each measurement: to continue, or the reason to stop. The value states it in words."""

    CONTINUE = "play the forces and measure"
    AT_FLOOR = "what is left cannot be distinguished from the measured noise"
    DIVERGING = "each correction made it worse; the best forces so far are kept"
    BEST_KEPT = "further corrections gain nothing; the best forces so far are kept"


@dataclass(frozen=True, slots=True, eq=False)
class Repetition:
    """Settings of an iteration, the same for all repeats."""

    wanted: FloatArray
    """(N, p): begins and ends at rest, with time for non-causal forces before and after."""
    invert: Invert
    sample_rate_hz: float
    band_hz: tuple[float, float]
    first_gain: float = 1.0
    """Gain of the first correction; below the `safe_beta` of `convergence`."""
    noise_floor: float | None = None
    """Noise of one play, rms in the band, in the unit of `wanted`; None = estimated from the first two plays, which use
    the same forces."""
    cap: float | None = None
    """Largest length of a force, N."""
    slew: float | None = None
    """Largest change of a force, N/s, by the corrections; the first forces are not limited by it."""
    judged: tuple[int, int] | None = None
    """First row and the one behind the last over which residuals are computed; None = all. Other rows are corrected
    too, but no reasonable force is right where a handle sticks after the motion."""

    def residual(self, missing: FloatArray) -> float:
        """rms over the judged rows."""
        start, stop = self.judged or (0, len(missing))
        return rms(missing[start:stop])

    @property
    def level(self) -> float:
        """Root mean square of the wanted signal in the band, over the judged rows."""
        return self.residual(self.part(self.wanted))

    def part(self, samples: FloatArray) -> FloatArray:
        """Part of samples (N, channels) within the band; they begin and end at rest, or are noise."""
        return band_part(samples, self.sample_rate_hz, self.band_hz)

    @property
    def degrees_of_freedom(self) -> float:
        """Degrees of freedom of the judged rows in the band."""
        low, high = self.band_hz
        start, stop = self.judged or (0, len(self.wanted))
        return float(2 * (high - low) * (stop - start) * self.wanted.shape[1] / self.sample_rate_hz)

    def find_allowed_share(self, forces: FloatArray, correction: FloatArray) -> float:
        """The largest share of a correction, up to 1, that cap and slew allow. Both (N, m)."""
        share = 1.0 if self.cap is None else largest_share(forces, correction, self.cap)
        if self.slew is None:
            return share
        steps, added = (np.diff(rows, axis=0, prepend=0.0, append=0.0) for rows in (forces, correction))
        return min(share, largest_share(steps, added, self.slew / self.sample_rate_hz))

    @property
    def limits(self) -> str:
        """The limits of force and slew rate in words, for remarks; empty without limits."""
        cap = [] if self.cap is None else [f"the force within {self.cap:g} N"]
        return " and ".join([*cap, *([] if self.slew is None else [f"its change within {self.slew:.4g} N/s"])])


@dataclass(frozen=True, slots=True, eq=False)
class IterationState:
    """State of iterative learning control between two plays: made by `begin`, advanced by `next_forces`."""

    repetition: Repetition
    forces: FloatArray
    """(N, m): forces to play next; with a verdict other than CONTINUE the best ones."""
    verdict: Verdict
    best: FloatArray
    """(N, m)"""
    best_residual: float
    best_missing: FloatArray
    """(N, p): residual after the best forces, noise included."""
    noise_floor: float | None
    residuals: tuple[float, ...] = ()
    """Residual of each play, rms of wanted minus measured in the band, noise included. Two plays that are averaged
    count as one."""
    gains: tuple[float, ...] = ()
    fitted: tuple[float, ...] = ()
    """Share of each correction that fitted under cap and slew limit; 1 = all."""
    setbacks: int = 0
    first_measured: FloatArray | None = None
    """(N, p): measurement of the first play, until the second gives the noise."""

    @property
    def errors(self) -> tuple[float, ...]:
        """Residuals relative to the wanted signal."""
        return tuple(residual / self.repetition.level for residual in self.residuals)

    @property
    def remark(self) -> str:
        """Effect of cap and slew limit in words, or empty."""
        lowest = min(self.fitted, default=1.0)
        if lowest >= 1:
            return ""
        return (
            f"{sum(share < 1 for share in self.fitted)} of {len(self.fitted)} corrections were scaled down, one to "
            f"{lowest:.0%}, to keep {self.repetition.limits}"
        )


def begin(repetition: Repetition, first: FloatArray | None = None) -> IterationState:
    """The state before the first play. first: (N, m), forces to begin with; None = the model's inverse of what is
    wanted. Raises ValueError where the first forces are above the cap, or what is wanted has nothing in the band."""
    if repetition.level == 0:
        low, high = repetition.band_hz
        raise ValueError(
            f"what is wanted has nothing in the band of {low:g} to {high:g} Hz; give a trajectory within it"
        )
    forces = repetition.invert(repetition.wanted) if first is None else np.asarray(first, dtype=np.float64)
    peak = float(np.linalg.norm(forces, axis=1).max())
    if repetition.cap is not None and peak > repetition.cap:
        raise ValueError(
            f"the first forces reach {peak:.4g} N, but the cap is {repetition.cap:g} N; scale the trajectory"
        )
    missing = np.zeros_like(repetition.wanted)
    return IterationState(repetition, forces, Verdict.CONTINUE, forces, np.inf, missing, repetition.noise_floor)


def next_forces(state: IterationState, measured: FloatArray) -> IterationState:
    """The state after a play: forces corrected by the measured error, and whether to go on. measured: (N, p), the
    answer to `state.forces`. Raises ValueError on another shape, on values that are not finite, and where the verdict
    was to stop."""
    repetition = state.repetition
    if state.verdict is not Verdict.CONTINUE:
        raise ValueError(f"this iteration is over: {state.verdict.value}")
    if np.shape(measured) != repetition.wanted.shape or not np.isfinite(measured).all():
        raise ValueError(
            f"what was measured has shape {np.shape(measured)} or values that are not finite numbers; it must be "
            f"{repetition.wanted.shape}"
        )
    if state.noise_floor is not None:
        return _judge_measurement(state, measured, state.noise_floor, plays=1)
    if state.first_measured is None:
        return replace(state, first_measured=measured)
    floor = noise_of_repeats(np.stack([state.first_measured, measured]), repetition)
    mean = (state.first_measured + measured) / 2
    return _judge_measurement(replace(state, noise_floor=floor, first_measured=None), mean, floor, plays=2)


def noise_of_repeats(measured: FloatArray, repetition: Repetition) -> float:
    """Noise of a single play: rms in the band of the differences between plays of the same forces. measured: (plays, N,
    p)."""
    off = measured - measured.mean(axis=0)
    squares = sum(float(np.sum(repetition.part(each) ** 2)) for each in off)
    return float(np.sqrt(squares / ((len(measured) - 1) * measured[0].size)))


def noise_of_rest(rest: FloatArray, repetition: Repetition) -> float:
    """Rms in the band of a record (n, p) during which nothing was commanded."""
    return rms(repetition.part(rest - rest.mean(axis=0)))


def rms(samples: FloatArray) -> float:
    """Root mean square over all entries, in their unit."""
    return float(np.sqrt(np.mean(samples**2)))


def _judge_measurement(state: IterationState, measured: FloatArray, floor: float, plays: int) -> IterationState:
    repetition = state.repetition
    missing = repetition.part(repetition.wanted - measured)
    residual, noise = repetition.residual(missing), floor / np.sqrt(plays)
    setbacks = state.setbacks + (residual > state.residuals[-1] if state.residuals else 0)
    state = replace(state, residuals=(*state.residuals, residual), setbacks=setbacks)
    diverged = residual > DIVERGED * state.best_residual
    base, left = state.forces, missing
    if residual < state.best_residual:
        state = replace(state, best=state.forces, best_residual=residual, best_missing=missing)
    elif residual > WORSE * state.best_residual:
        base, left = state.best, state.best_missing
    # Two measured powers are compared, each with its own random error.
    limit = noise * np.sqrt(1 + SURE * np.sqrt(4 / repetition.degrees_of_freedom))
    if residual <= limit:
        return _finish(state, Verdict.AT_FLOOR)
    if diverged:
        return _finish(state, Verdict.DIVERGING)
    signal_share = max(0.0, 1 - (noise / repetition.residual(left)) ** 2)
    gain = min(repetition.first_gain / (1 + setbacks), signal_share)
    if gain < LOWEST_GAIN:
        return _finish(state, Verdict.BEST_KEPT)
    return _correct_forces(state, base, left, gain)


def _finish(state: IterationState, verdict: Verdict) -> IterationState:
    return replace(state, forces=state.best, verdict=verdict)


def _correct_forces(state: IterationState, base: FloatArray, left: FloatArray, gain: float) -> IterationState:
    repetition = state.repetition
    correction = gain * fade_ends(repetition.invert(left), repetition.sample_rate_hz)
    fitted = repetition.find_allowed_share(base, correction)
    if fitted < LOWEST_GAIN:
        return _finish(state, Verdict.BEST_KEPT)
    return replace(state, forces=base + fitted * correction, gains=(*state.gains, gain), fitted=(*state.fitted, fitted))


def fade_ends(rows: FloatArray, sample_rate_hz: float) -> FloatArray:
    """Fade rows (N, m) to zero at the first and the last row."""
    until_end = np.minimum(np.arange(len(rows)), np.arange(len(rows))[::-1])
    inside = np.clip(until_end / (EDGE_S * sample_rate_hz), 0.0, 1.0)
    return np.asarray(rows * (0.5 - 0.5 * np.cos(np.pi * inside))[:, np.newaxis])


def largest_share(forces: FloatArray, correction: FloatArray, cap: float) -> float:
    """The largest share of `correction` (N, m), up to 1, with which no force is longer than `cap`."""
    a = np.sum(correction**2, axis=1)
    b = np.sum(forces * correction, axis=1)
    room = np.maximum(cap**2 - np.sum(forces**2, axis=1), 0.0)
    moving = a > 0
    # The positive root of a s² + 2 b s = room.
    roots = (np.sqrt(b[moving] ** 2 + a[moving] * room[moving]) - b[moving]) / a[moving]
    # Slightly less than the exact share, so that rounding does not put the longest force above the cap.
    return float(min(1.0, (1 - 1e-9) * roots.min(initial=2.0)))
