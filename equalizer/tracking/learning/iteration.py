"""Iterative learning control: play forces, measure the response, correct the forces, until a `Verdict` ends it.

    u <- u + beta L(band(r - y)),        beta = min(beta_0 / (1 + setbacks), 1 - (noise / residual)²)

with forces u, reference motion r, measured motion y and the inverse L of the model (method: Bristow, Tharayil and
Alleyne, IEEE Control Systems 26 (2006), 96). The second bound of beta is the share of the error power that is not
noise: nearly 1 for a large error and small near the noise floor. With a fixed gain noise would be learned, and good
initial forces would get worse. A setback is a repeat that increased the error; the best forces are kept.

Corrections are faded to zero at both ends of the record. An inverse that cannot act before the first row would respond
to an error there with an impulse; a handle held by static friction would not move, and the impulse would grow with
every repeat. Called by `study.workflows.equalizer.repeat_playback`, which plays the forces between the steps.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np

from equalizer.signals.signal import FloatArray
from equalizer.tracking.feedforward.band_pass import filter_to_band, remove_trend

InverseOperator = Callable[[FloatArray], FloatArray]
"""Linear inverse of the device: from reference motion (N, p) to forces (N, m), in N, with N rows in time each."""

SIGNIFICANCE_SIGMA = 3.0
"""A residual power this many standard deviations above the noise power is more than noise. Chosen."""
WORSE_RATIO, DIVERGENCE_RATIO = 1.1, 2.0
"""Ratios of a residual to the smallest so far: above the first, the next correction starts from the best forces again;
above the second, the iteration ends as diverging. Chosen."""
LOWEST_GAIN = 0.03
"""Gain, or factor left by cap and slew limit, below which the iteration ends, because a correction makes no measurable
change. Chosen."""
EDGE_S = 0.03
"""Time (s) over which corrections are faded to zero at either end of the record. Chosen."""


class Verdict(Enum):
    """Decision after each measurement: to continue, or the reason to stop; the value is a text for the user."""

    CONTINUE = "play the forces and measure"
    AT_FLOOR = "the residual cannot be distinguished from the measured noise"
    DIVERGING = "the residual grew to more than twice the smallest; the best forces so far are kept"
    BEST_KEPT = "further corrections gain nothing; the best forces so far are kept"


@dataclass(frozen=True, slots=True, eq=False)
class IterationSettings:
    """Settings of an iteration, the same for all repeats."""

    reference: FloatArray
    """(N, p), reference motion: begins and ends at rest, with time for non-causal forces before and after."""
    invert: InverseOperator
    sample_rate_hz: float
    band_hz: tuple[float, float]
    """Band (Hz) in which errors are computed and corrected."""
    first_gain: float = 1.0
    """Upper bound beta_0 of the gain; to be chosen below the `safe_beta` of `convergence`."""
    noise_floor: float | None = None
    """Noise of a single play, rms in the band, in the unit of `reference`; None = estimated from the first two plays,
    which use the same forces."""
    cap_n: float | None = None
    """Largest norm of the force vector of a row, N; None = not limited."""
    slew_n_per_s: float | None = None
    """Largest rate of change of the corrected force vector, N/s; None = not limited. The first forces are not checked
    against it."""
    judged_rows: tuple[int, int] | None = None
    """Rows [first, end) over which residuals are computed; None = all. Other rows are corrected too, but do not count:
    after the motion static friction may hold the handle, and no reasonable force moves it exactly."""

    def compute_residual(self, error: FloatArray) -> float:
        """Compute the rms of the error (N, p) over the judged rows and all channels, in the unit of `reference`."""
        start, stop = self.judged_rows or (0, len(error))
        return rms(error[start:stop])

    @property
    def level(self) -> float:
        """Root mean square of the reference motion in the band, over the judged rows."""
        return self.compute_residual(self.extract_band(self.reference))

    def extract_band(self, samples: FloatArray) -> FloatArray:
        """Extract the part of samples (N, channels) within the band; samples begin and end at rest, or are noise,
        except for the sensor's offset and drift: the straight line is removed first, with it that part of the motion,
        which is in the band only where that begins below a few periods per record."""
        return filter_to_band(remove_trend(samples), self.sample_rate_hz, self.band_hz)

    @property
    def degrees_of_freedom(self) -> float:
        """Degrees of freedom of the judged rows in the band: 2 x bandwidth x duration x channels."""
        low_hz, high_hz = self.band_hz
        start, stop = self.judged_rows or (0, len(self.reference))
        return float(2 * (high_hz - low_hz) * (stop - start) * self.reference.shape[1] / self.sample_rate_hz)

    def find_allowed_share(self, forces: FloatArray, correction: FloatArray) -> float:
        """Find the largest factor on the correction, up to 1, with which forces plus correction obey cap and slew
        limit. Both (N, m) in N. The slew limit includes the steps from zero to the first row and from the last row to
        zero."""
        share = 1.0 if self.cap_n is None else find_largest_share(forces, correction, self.cap_n)
        if self.slew_n_per_s is None:
            return share
        force_steps, correction_steps = (
            np.diff(rows, axis=0, prepend=0.0, append=0.0) for rows in (forces, correction)
        )
        return min(share, find_largest_share(force_steps, correction_steps, self.slew_n_per_s / self.sample_rate_hz))

    @property
    def limits(self) -> str:
        """Text of the limits of force and slew rate, for remarks; empty without limits."""
        cap_texts = [] if self.cap_n is None else [f"the force within {self.cap_n:g} N"]
        return " and ".join(
            [*cap_texts, *([] if self.slew_n_per_s is None else [f"its change within {self.slew_n_per_s:.4g} N/s"])]
        )


@dataclass(frozen=True, slots=True, eq=False)
class IterationState:
    """State of iterative learning control between two plays: made by `start_iteration`, advanced by `update_forces`."""

    settings: IterationSettings
    forces: FloatArray
    """(N, m): forces (N) to play next; the best forces once the verdict is not CONTINUE."""
    verdict: Verdict
    best_forces: FloatArray
    """(N, m): forces (N) with the smallest residual so far."""
    best_residual: float
    """Residual of the best forces, rms, in the unit of `IterationSettings.reference`; infinite before the first."""
    best_error: FloatArray
    """(N, p): error signal in the band after the best forces, noise included; zeros before the first."""
    noise_floor: float | None
    """As `IterationSettings.noise_floor`; None until it is known."""
    residuals: tuple[float, ...] = ()
    """Residual of each play, rms of reference minus measured motion in the band, noise included. Two plays that are
    averaged count as one."""
    gains: tuple[float, ...] = ()
    """Gain beta of each correction, before cap and slew limit."""
    scales: tuple[float, ...] = ()
    """Factor by which cap and slew limit scaled each correction; 1 = not reduced."""
    setbacks: int = 0
    """Number of plays with a larger residual than the play before."""
    first_measured: FloatArray | None = None
    """(N, p): measurement of the first play, until the second gives the noise."""

    @property
    def errors(self) -> tuple[float, ...]:
        """Residuals relative to the rms of the reference motion in the band (`IterationSettings.level`)."""
        return tuple(residual / self.settings.level for residual in self.residuals)

    @property
    def remark(self) -> str:
        """Sentence on the corrections that cap and slew limit reduced; empty where they reduced none."""
        lowest_scale = min(self.scales, default=1.0)
        if lowest_scale >= 1:
            return ""
        return (
            f"{sum(scale < 1 for scale in self.scales)} of {len(self.scales)} corrections were scaled down, one to "
            f"{lowest_scale:.0%}, to keep {self.settings.limits}"
        )


def start_iteration(settings: IterationSettings, initial_forces: FloatArray | None = None) -> IterationState:
    """Make the state before the first play. initial_forces: (N, m), N; None = the model's inverse of the reference
    motion. Raises ValueError where the initial forces exceed the cap, or the reference motion has no part in the
    band over the judged rows."""
    if settings.level == 0:
        low_hz, high_hz = settings.band_hz
        raise ValueError(
            f"the reference trajectory has no content in the band of {low_hz:g} to {high_hz:g} Hz; "
            "give a trajectory within it"
        )
    forces = (
        settings.invert(settings.reference) if initial_forces is None else np.asarray(initial_forces, dtype=np.float64)
    )
    peak_n = float(np.linalg.norm(forces, axis=1).max())
    if settings.cap_n is not None and peak_n > settings.cap_n:
        raise ValueError(
            f"the first forces reach {peak_n:.4g} N, but the cap is {settings.cap_n:g} N; scale the trajectory"
        )
    no_error = np.zeros_like(settings.reference)
    return IterationState(settings, forces, Verdict.CONTINUE, forces, np.inf, no_error, settings.noise_floor)


def update_forces(state: IterationState, measured: FloatArray) -> IterationState:
    """Correct the forces by the measured error of a play, and decide whether to continue. measured: (N, p), the
    response to `state.forces`. Without a known noise floor the first call leaves the forces unchanged, because the same
    forces have to be played twice. Raises ValueError for another shape, for values that are not finite, and where the
    verdict was to stop."""
    settings = state.settings
    if state.verdict is not Verdict.CONTINUE:
        raise ValueError(f"this iteration is over: {state.verdict.value}")
    if np.shape(measured) != settings.reference.shape or not np.isfinite(measured).all():
        raise ValueError(
            f"the measured motion has shape {np.shape(measured)} or values that are not finite numbers; its shape must "
            f"be {settings.reference.shape}"
        )
    if state.noise_floor is not None:
        return _judge_measurement(state, measured, state.noise_floor, play_count=1)
    if state.first_measured is None:
        return replace(state, first_measured=measured)
    play_noise = estimate_repeat_noise(np.stack([state.first_measured, measured]), settings)
    mean_measured = (state.first_measured + measured) / 2
    return _judge_measurement(
        replace(state, noise_floor=play_noise, first_measured=None), mean_measured, play_noise, play_count=2
    )


def estimate_repeat_noise(measured: FloatArray, settings: IterationSettings) -> float:
    """Estimate the noise of a single play: rms in the band of the deviations from the mean of several plays of the same
    forces (sample standard deviation). measured: (plays, N, p), at least two plays."""
    deviations = measured - measured.mean(axis=0)
    sum_of_squares = sum(float(np.sum(settings.extract_band(deviation) ** 2)) for deviation in deviations)
    return float(np.sqrt(sum_of_squares / ((len(measured) - 1) * measured[0].size)))


def estimate_rest_noise(rest_record: FloatArray, settings: IterationSettings) -> float:
    """Estimate the noise of a play: rms in the band of a record (n, p) during which no force was commanded."""
    return rms(settings.extract_band(rest_record))


def rms(samples: FloatArray) -> float:
    """Compute the root mean square over all entries, in their unit."""
    return float(np.sqrt(np.mean(samples**2)))


def _judge_measurement(
    state: IterationState, measured: FloatArray, play_noise: float, play_count: int
) -> IterationState:
    """Decide after a measurement, the mean of `play_count` plays, whether to stop or to correct the forces. play_noise:
    noise floor of a single play, rms in the band."""
    settings = state.settings
    error = settings.extract_band(settings.reference - measured)
    residual, mean_noise = settings.compute_residual(error), play_noise / np.sqrt(play_count)
    setbacks = state.setbacks + (residual > state.residuals[-1] if state.residuals else 0)
    state = replace(state, residuals=(*state.residuals, residual), setbacks=setbacks)
    is_diverging = residual > DIVERGENCE_RATIO * state.best_residual
    base_forces, error_to_correct = state.forces, error
    if residual < state.best_residual:
        state = replace(state, best_forces=state.forces, best_residual=residual, best_error=error)
    elif residual > WORSE_RATIO * state.best_residual:
        base_forces, error_to_correct = state.best_forces, state.best_error
    # Residual and noise power are both measured, each with the relative variance 2 / (degrees of freedom); the ratio
    # of both then has the relative standard deviation sqrt(4 / (degrees of freedom)).
    noise_limit = mean_noise * np.sqrt(1 + SIGNIFICANCE_SIGMA * np.sqrt(4 / settings.degrees_of_freedom))
    if residual <= noise_limit:
        return _finish(state, Verdict.AT_FLOOR)
    if is_diverging:
        return _finish(state, Verdict.DIVERGING)
    signal_share = max(0.0, 1 - (mean_noise / settings.compute_residual(error_to_correct)) ** 2)
    gain = min(settings.first_gain / (1 + setbacks), signal_share)
    if gain < LOWEST_GAIN:
        return _finish(state, Verdict.BEST_KEPT)
    return _correct_forces(state, base_forces, error_to_correct, gain)


def _finish(state: IterationState, verdict: Verdict) -> IterationState:
    """End the iteration: returns the state with the best forces and the reason to stop."""
    return replace(state, forces=state.best_forces, verdict=verdict)


def _correct_forces(
    state: IterationState, base_forces: FloatArray, error_to_correct: FloatArray, gain: float
) -> IterationState:
    """Correct the forces `base_forces` (N, m) for the error `error_to_correct` (N, p): returns the next state, final
    where cap or slew limit leave less than LOWEST_GAIN of the correction."""
    settings = state.settings
    correction = gain * fade_ends(settings.invert(error_to_correct), settings.sample_rate_hz)
    scale = settings.find_allowed_share(base_forces, correction)
    if scale < LOWEST_GAIN:
        return _finish(state, Verdict.BEST_KEPT)
    return replace(
        state, forces=base_forces + scale * correction, gains=(*state.gains, gain), scales=(*state.scales, scale)
    )


def fade_ends(rows: FloatArray, sample_rate_hz: float) -> FloatArray:
    """Multiply rows (N, m) by a raised-cosine ramp of `EDGE_S` seconds at either end; the first and the last row become
    zero."""
    rows_to_nearest_end = np.minimum(np.arange(len(rows)), np.arange(len(rows))[::-1])
    ramp_position = np.clip(rows_to_nearest_end / (EDGE_S * sample_rate_hz), 0.0, 1.0)
    return np.asarray(rows * (0.5 - 0.5 * np.cos(np.pi * ramp_position))[:, np.newaxis])


def find_largest_share(forces: FloatArray, correction: FloatArray, cap: float) -> float:
    """Find the largest factor s, up to 1, with which no row of forces + s correction has a norm above `cap`. Both (N,
    m), in the unit of the cap. A row of the forces above the cap counts as at the cap: the correction may not increase
    its norm."""
    squared_correction = np.sum(correction**2, axis=1)
    correction_times_force = np.sum(forces * correction, axis=1)
    headroom = np.maximum(cap**2 - np.sum(forces**2, axis=1), 0.0)
    is_corrected = squared_correction > 0
    # The positive root s of |forces + s correction|² = cap², that is, of a s² + 2 b s = headroom,
    # with a = |correction|² and b = forces · correction of a row.
    roots = (
        np.sqrt(correction_times_force[is_corrected] ** 2 + squared_correction[is_corrected] * headroom[is_corrected])
        - correction_times_force[is_corrected]
    ) / squared_correction[is_corrected]
    # Slightly less than the exact share, so that rounding does not put the longest force above the cap.
    return float(min(1.0, (1 - 1e-9) * roots.min(initial=2.0)))
