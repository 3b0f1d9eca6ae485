"""Iterative learning control: play forces, measure the response, correct the forces, until the error is noise only.

    u <- u + beta L(band(r - y)),        beta = min(beta_0 / (1 + setbacks), 1 - (noise / residual)²)

with forces u, wanted motion r, measured motion y and the inverse L of the model; the survey by Bristow, Tharayil and
Alleyne that `convergence` cites describes the method. The second bound of beta is the share of the error power that is
not noise: nearly 1 for a large error and small near the noise floor. With a fixed gain noise would be learned, and good
initial forces would get worse. A setback is a repeat that increased the error; the best forces are kept.

Corrections are faded to zero at both ends of the record. An inverse that cannot act before the first row would respond
to an error there with an impulse; a handle held by static friction would not move, and the impulse would grow with
every repeat.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np

from equalizer.signals.signal import FloatArray
from equalizer.tracking.feedforward.band_part import band_part

Invert = Callable[[FloatArray], FloatArray]
"""Linear inverse of the device: from wanted motion (N, p) to forces (N, m), with N rows in time each."""

SIGNIFICANCE_SIGMA = 3.0
"""A residual power this many standard deviations above the noise power is more than noise."""
WORSE_RATIO, DIVERGENCE_RATIO = 1.1, 2.0
"""Ratios of a residual to the smallest so far: above the first, the next correction starts from the best forces again;
above the second, the iteration counts as diverging."""
LOWEST_GAIN = 0.03
"""Gain below which the iteration ends, because a correction makes no measurable change."""
EDGE_S = 0.03
"""Time (s) over which corrections are faded at either end of the record."""


class Verdict(Enum):
    """Decision after each measurement: to continue, or the reason to stop, with a text for the user as value."""

    CONTINUE = "play the forces and measure"
    AT_FLOOR = "the residual cannot be distinguished from the measured noise"
    DIVERGING = "each correction made it worse; the best forces so far are kept"
    BEST_KEPT = "further corrections gain nothing; the best forces so far are kept"


@dataclass(frozen=True, slots=True, eq=False)
class Repetition:
    """Settings of an iteration, the same for all repeats."""

    reference: FloatArray
    """(N, p): begins and ends at rest, with time for non-causal forces before and after."""
    invert: Invert
    sample_rate_hz: float
    band_hz: tuple[float, float]
    first_gain: float = 1.0
    """Upper bound beta_0 of the gain; to be chosen below the `safe_beta` of `convergence`."""
    noise_floor: float | None = None
    """Noise of one play, rms in the band, in the unit of `wanted`; None = estimated from the first two plays, which use
    the same forces."""
    cap: float | None = None
    """Largest magnitude of the force vector of a row, N; None = not limited."""
    slew: float | None = None
    """Largest rate of change of the corrected force vector, N/s; None = not limited. The first forces are not checked
    against it."""
    judged_rows: tuple[int, int] | None = None
    """Rows [first, end) over which residuals are computed; None = all. Other rows are corrected too, but are not
    judged: after the motion static friction may hold the handle, and no reasonable force moves it exactly."""

    def residual(self, missing: FloatArray) -> float:
        """Root mean square of the error (N, p) over the judged rows and all channels, in the unit of `wanted`."""
        start, stop = self.judged_rows or (0, len(missing))
        return rms(missing[start:stop])

    @property
    def level(self) -> float:
        """Root mean square of the wanted signal in the band, over the judged rows."""
        return self.residual(self.part(self.reference))

    def part(self, samples: FloatArray) -> FloatArray:
        """Part of samples (N, channels) within the band; they begin and end at rest, or are noise."""
        return band_part(samples, self.sample_rate_hz, self.band_hz)

    @property
    def degrees_of_freedom(self) -> float:
        """Degrees of freedom of the judged rows in the band: 2 x bandwidth x duration x channels."""
        low, high = self.band_hz
        start, stop = self.judged_rows or (0, len(self.reference))
        return float(2 * (high - low) * (stop - start) * self.reference.shape[1] / self.sample_rate_hz)

    def find_allowed_share(self, forces: FloatArray, correction: FloatArray) -> float:
        """Largest factor on the correction, up to 1, with which forces plus correction obey cap and slew limit. Both
        (N, m) in N."""
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
    """State of iterative learning control between two plays: made by `start_iteration`, advanced by `next_forces`."""

    repetition: Repetition
    forces: FloatArray
    """(N, m): forces (N) to play next; the best forces once the verdict is not CONTINUE."""
    verdict: Verdict
    best: FloatArray
    """(N, m): forces (N) with the smallest residual so far."""
    best_residual: float
    """Residual of the best forces, rms, in the unit of `wanted`; infinite before the first."""
    best_missing: FloatArray
    """(N, p): error signal in the band after the best forces, noise included."""
    noise_floor: float | None
    """As `Repetition.noise_floor`; None until it is known."""
    residuals: tuple[float, ...] = ()
    """Residual of each play, rms of wanted minus measured in the band, noise included. Two plays that are averaged
    count as one."""
    gains: tuple[float, ...] = ()
    """Gain beta of each correction, before cap and slew limit."""
    fitted: tuple[float, ...] = ()
    """Factor on each correction by which cap and slew limit reduced it; 1 = not reduced."""
    setbacks: int = 0
    """Number of repeats with a larger residual than the one before."""
    first_measured: FloatArray | None = None
    """(N, p): measurement of the first play, until the second gives the noise."""

    @property
    def errors(self) -> tuple[float, ...]:
        """Residuals relative to the wanted signal."""
        return tuple(residual / self.repetition.level for residual in self.residuals)

    @property
    def remark(self) -> str:
        """Sentence on the corrections that cap and slew limit reduced; empty where they reduced none."""
        lowest = min(self.fitted, default=1.0)
        if lowest >= 1:
            return ""
        return (
            f"{sum(share < 1 for share in self.fitted)} of {len(self.fitted)} corrections were scaled down, one to "
            f"{lowest:.0%}, to keep {self.repetition.limits}"
        )


def start_iteration(repetition: Repetition, first: FloatArray | None = None) -> IterationState:
    """The state before the first play. first: (N, m), initial forces (N); None = the model's inverse of the wanted
    motion. Raises ValueError where the first forces exceed the cap, or the wanted motion has no part in the band."""
    if repetition.level == 0:
        low, high = repetition.band_hz
        raise ValueError(
            f"the wanted trajectory has no content in the band of {low:g} to {high:g} Hz; give a trajectory within it"
        )
    forces = repetition.invert(repetition.reference) if first is None else np.asarray(first, dtype=np.float64)
    peak = float(np.linalg.norm(forces, axis=1).max())
    if repetition.cap is not None and peak > repetition.cap:
        raise ValueError(
            f"the first forces reach {peak:.4g} N, but the cap is {repetition.cap:g} N; scale the trajectory"
        )
    missing = np.zeros_like(repetition.reference)
    return IterationState(repetition, forces, Verdict.CONTINUE, forces, np.inf, missing, repetition.noise_floor)


def next_forces(state: IterationState, measured: FloatArray) -> IterationState:
    """The state after a play: the forces corrected by the measured error, and the verdict. measured: (N, p), the
    response to `state.forces`. Raises ValueError for another shape, for values that are not finite, and where the
    verdict was to stop. Without a known noise floor the same forces are due twice."""
    repetition = state.repetition
    if state.verdict is not Verdict.CONTINUE:
        raise ValueError(f"this iteration is over: {state.verdict.value}")
    if np.shape(measured) != repetition.reference.shape or not np.isfinite(measured).all():
        raise ValueError(
            f"what was measured has shape {np.shape(measured)} or values that are not finite numbers; it must be "
            f"{repetition.reference.shape}"
        )
    if state.noise_floor is not None:
        return _judge_measurement(state, measured, state.noise_floor, plays=1)
    if state.first_measured is None:
        return replace(state, first_measured=measured)
    floor = noise_of_repeats(np.stack([state.first_measured, measured]), repetition)
    mean = (state.first_measured + measured) / 2
    return _judge_measurement(replace(state, noise_floor=floor, first_measured=None), mean, floor, plays=2)


def noise_of_repeats(measured: FloatArray, repetition: Repetition) -> float:
    """Noise of a single play: rms in the band of the deviations from the mean of several plays of the same forces
    (sample standard deviation). measured: (plays, N, p), at least two plays."""
    deviations = measured - measured.mean(axis=0)
    squares = sum(float(np.sum(repetition.part(deviation) ** 2)) for deviation in deviations)
    return float(np.sqrt(squares / ((len(measured) - 1) * measured[0].size)))


def noise_of_rest(rest_record: FloatArray, repetition: Repetition) -> float:
    """Rms in the band of a record (n, p) during which no force was commanded; the mean is removed first."""
    return rms(repetition.part(rest_record - rest_record.mean(axis=0)))


def rms(samples: FloatArray) -> float:
    """Root mean square over all entries, in their unit."""
    return float(np.sqrt(np.mean(samples**2)))


def _judge_measurement(state: IterationState, measured: FloatArray, play_noise: float, plays: int) -> IterationState:
    """The state after a measurement with this noise floor of a single play, averaged over so many plays: a stop, or
    corrected forces."""
    repetition = state.repetition
    missing = repetition.part(repetition.reference - measured)
    residual, noise = repetition.residual(missing), play_noise / np.sqrt(plays)
    setbacks = state.setbacks + (residual > state.residuals[-1] if state.residuals else 0)
    state = replace(state, residuals=(*state.residuals, residual), setbacks=setbacks)
    diverged = residual > DIVERGENCE_RATIO * state.best_residual
    base_forces, error_signal = state.forces, missing
    if residual < state.best_residual:
        state = replace(state, best=state.forces, best_residual=residual, best_missing=missing)
    elif residual > WORSE_RATIO * state.best_residual:
        base_forces, error_signal = state.best, state.best_missing
    # Residual and noise power are both measured, each with the relative variance 2 / (degrees of freedom); the ratio
    # of both then has the relative standard deviation sqrt(4 / (degrees of freedom)).
    limit = noise * np.sqrt(1 + SIGNIFICANCE_SIGMA * np.sqrt(4 / repetition.degrees_of_freedom))
    if residual <= limit:
        return _finish(state, Verdict.AT_FLOOR)
    if diverged:
        return _finish(state, Verdict.DIVERGING)
    signal_share = max(0.0, 1 - (noise / repetition.residual(error_signal)) ** 2)
    gain = min(repetition.first_gain / (1 + setbacks), signal_share)
    if gain < LOWEST_GAIN:
        return _finish(state, Verdict.BEST_KEPT)
    return _correct_forces(state, base_forces, error_signal, gain)


def _finish(state: IterationState, verdict: Verdict) -> IterationState:
    """The final state, with the best forces."""
    return replace(state, forces=state.best, verdict=verdict)


def _correct_forces(
    state: IterationState, base_forces: FloatArray, error_signal: FloatArray, gain: float
) -> IterationState:
    """The state with the forces `base_forces` (N, m) corrected for the error `error_signal` (N, p); final where cap or
    slew limit leave nearly nothing of the correction."""
    repetition = state.repetition
    correction = gain * fade_ends(repetition.invert(error_signal), repetition.sample_rate_hz)
    fitted = repetition.find_allowed_share(base_forces, correction)
    if fitted < LOWEST_GAIN:
        return _finish(state, Verdict.BEST_KEPT)
    return replace(
        state, forces=base_forces + fitted * correction, gains=(*state.gains, gain), fitted=(*state.fitted, fitted)
    )


def fade_ends(rows: FloatArray, sample_rate_hz: float) -> FloatArray:
    """Rows (N, m) faded to zero at the first and the last row by a raised-cosine ramp of `EDGE_S` seconds."""
    until_end = np.minimum(np.arange(len(rows)), np.arange(len(rows))[::-1])
    ramp_position = np.clip(until_end / (EDGE_S * sample_rate_hz), 0.0, 1.0)
    return np.asarray(rows * (0.5 - 0.5 * np.cos(np.pi * ramp_position))[:, np.newaxis])


def largest_share(forces: FloatArray, correction: FloatArray, cap: float) -> float:
    """Largest factor s, up to 1, with which no row of forces + s correction is longer than `cap`. Both (N, m)."""
    a = np.sum(correction**2, axis=1)
    b = np.sum(forces * correction, axis=1)
    headroom = np.maximum(cap**2 - np.sum(forces**2, axis=1), 0.0)
    is_corrected = a > 0
    # The positive root s of |forces + s correction|² = cap², that is, of a s² + 2 b s = room.
    roots = (np.sqrt(b[is_corrected] ** 2 + a[is_corrected] * headroom[is_corrected]) - b[is_corrected]) / a[
        is_corrected
    ]
    # Slightly less than the exact share, so that rounding does not put the longest force above the cap.
    return float(min(1.0, (1 - 1e-9) * roots.min(initial=2.0)))
