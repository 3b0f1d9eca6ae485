"""What a hand was given, judged from what was asked for, what the encoders said and what was written; it shares no code
with the safety layer and knows none of its cells."""

import math
from dataclasses import dataclass

import numpy as np

from equalizer.signals.signal import FloatArray
from study.devices.device import DeviceSettings
from study.session.stimulus.held_stimulus import HeldStimulus

NEVER = 10**9
ROUNDING_N = 1e-9
FAINT_N = 1e-3
"""The rest of a release that late ticks held up is let go in a fade of its own: of so little no direction is judged."""


@dataclass(frozen=True, eq=False)
class Run:
    """One hold, from rest. n: ticks until all was over or the run ended. Ticks count from 0."""

    stimulus: HeldStimulus
    settings: DeviceSettings
    stiffness: float
    rate_hz: float
    forces_n: FloatArray
    """(n, 3): what the device held during each tick."""
    readings_m: FloatArray
    """(n, 3): what its encoders said, lies and all. Rows of late ticks are of no meaning."""
    late: FloatArray
    """(n,), bool: ticks without a sign of life."""
    over: bool
    release_at: int = NEVER
    """When the stimulus' own release was asked for."""
    silent_from: int = NEVER
    """The first tick without a sign of life."""
    told_by: int = NEVER
    """A lie that must be told: from this tick on there is no force."""
    corrupted: bool = False
    """Whether the safety layer's own memory was overwritten meanwhile: then only the cap counts."""


def violations_of(run: Run) -> list[str]:
    """In words, with the tick where it begins."""
    forces, limits = run.forces_n, run.settings.limits
    found = []
    if not np.isfinite(forces).all():
        return ["not a number"]
    norms = np.linalg.norm(forces, axis=1)
    if (norms > limits.total_cap_n).any():
        found.append(f"total: {norms.max():.4f} N")
    if run.corrupted:
        return found
    release = max(1, math.floor(limits.release_s * run.rate_hz))
    found += _too_long(run, norms, release)
    share, bound = stimulus_share(run), feedback_bound(run)
    strange = ~run.late & ~_is_nominal(run, share, bound)
    first = min(int(np.argmax(strange)) if strange.any() else len(forces), _last_release(run, release))
    if first < len(forces):
        found += _not_a_release(run, first, release)
    found += _too_steep(run, first)
    found += _pushed_outward(run, share, first)
    found += _jerk(run, share, bound, first)
    if run.over and norms[-1:].any():
        found.append("over, with a force left")
    return found


def stimulus_share(run: Run) -> FloatArray:
    """(n, 3): the stimulus as its profile promises it, capped, without feedback."""
    n, stimulus, rate_hz = len(run.forces_n), run.stimulus, run.rate_hz
    ticks = np.arange(n)
    samples = stimulus.loop.samples[ticks % len(stimulus.loop)]
    norms = np.linalg.norm(samples, axis=1, keepdims=True)
    samples = samples * np.minimum(1.0, run.settings.limits.stimulus_cap_n / np.maximum(norms, 1e-300))
    return samples * (_gain(run, ticks, rate_hz))[:, None]


def _gain(run: Run, ticks: FloatArray, rate_hz: float) -> FloatArray:
    rise, fall = round(run.stimulus.fade_in_s * rate_hz), round(run.stimulus.fade_out_s * rate_hz)
    up = np.clip(ticks / rise, 0.0, 1.0) if rise else np.ones(len(ticks))
    asked = _heard_at(run)
    before = np.flatnonzero(~run.late & (ticks < asked))
    reached = before[-1] if len(before) else 0
    up = np.where(ticks >= asked, np.clip(reached / rise, 0.0, 1.0) if rise else 1.0, up)
    left = 1.0 - np.clip((ticks - asked) / fall, 0.0, 1.0) if fall else np.where(ticks >= asked, 0.0, 1.0)
    if run.stimulus.fade_shape == "raised_cosine":
        up, left = 0.5 - 0.5 * np.cos(np.pi * up), 0.5 - 0.5 * np.cos(np.pi * left)
    return np.where(ticks >= asked, up * left, up)


def _heard_at(run: Run) -> int:
    """A late tick hears nothing."""
    attended = np.flatnonzero(~run.late)
    after = attended[attended >= run.release_at]
    return int(after[0]) if len(after) else NEVER


def feedback_bound(run: Run) -> FloatArray:
    """(n,): what spring and damper may pull with, from the readings alone. A low-passed speed is a mean of past speeds,
    so that the damper's share is below that of the fastest so far."""
    cap = run.settings.limits.feedback_cap_n
    spring = np.minimum(run.stiffness * _norms(run.readings_m - np.array(run.settings.place_m)), cap)
    return np.minimum(spring + _damper_bound(run), cap)


def _norms(vectors: FloatArray) -> FloatArray:
    """Of rows; what is no number, or no length that a room has, counts as 1000 m."""
    return np.linalg.norm(np.clip(np.nan_to_num(vectors, nan=1e3), -1e3, 1e3), axis=1)


def _damper_bound(run: Run) -> FloatArray:
    attended = np.flatnonzero(~run.late)
    speeds = np.zeros(len(run.forces_n))
    if len(attended) > 1:
        ways = _norms(np.diff(np.clip(np.nan_to_num(run.readings_m[attended], nan=1e3), -1e3, 1e3), axis=0))
        speeds[attended[1:]] = ways / np.diff(attended) * run.rate_hz
    damping = run.settings.spring_damping_n_s_per_m
    fastest = np.maximum.accumulate(speeds)
    return np.minimum(damping * fastest, run.settings.limits.feedback_cap_n) if damping else np.zeros(len(speeds))


def _is_nominal(run: Run, share: FloatArray, bound: FloatArray) -> FloatArray:
    """Within the feedback of the stimulus; or on the way there, as fast as the slew limit lets it."""
    forces = run.forces_n
    before = np.concatenate([np.zeros((1, 3)), forces[:-1]])
    outside = np.linalg.norm(forces - share, axis=1) - bound
    was_outside = np.linalg.norm(before - share, axis=1) - bound
    step = run.settings.limits.slew_n_per_s / run.rate_hz
    slewing = np.linalg.norm(forces - before, axis=1) >= 0.999 * step
    nearer = slewing & (outside <= was_outside + ROUNDING_N)  # a ball is convex
    return (outside <= ROUNDING_N) | nearer


def _last_release(run: Run, release: int) -> int:
    """Where a straight release begins that brings the run to its end, if that can be told: up to there the stimulus
    must be whole, though the first part of a release is no further from it than a spring is."""
    n, forces = len(run.forces_n), run.forces_n
    asleep = int(run.late[-release:].sum()) + 95 if run.late.any() else 0
    for start in range(max(1, n - release - asleep), n - 1):
        ticks = np.flatnonzero(~run.late[start:])
        left = np.clip(1.0 - (ticks + 1) / release, 0.0, 1.0)
        ends = len(ticks) > 1 and (left[-1] == 0.0 or not run.over)
        if ends and np.allclose(forces[start:][ticks], left[:, None] * forces[start - 1], rtol=0.0, atol=ROUNDING_N):
            return start
    return n


def _not_a_release(run: Run, first: int, release: int) -> list[str]:
    """From here on the force must fade along itself, never rising and never turning round, and be zero in time."""
    forces = run.forces_n[first:]
    start = run.forces_n[first - 1] if first else np.zeros(3)
    size = float(np.linalg.norm(start))
    if size <= ROUNDING_N:
        return [f"strange: a force out of nothing at tick {first}"] if (np.abs(forces) > 1e-6).any() else []
    gains = forces @ start / size**2
    aside = np.linalg.norm(forces - gains[:, None] * start, axis=1)
    found = []
    if (gains < -1e-9).any():
        found.append(f"fade: its sign flips at tick {first + int(np.argmax(gains < -1e-9))}")
    if (aside > 1e-6).any() or (np.diff(gains, prepend=1.0) > 1e-9).any():
        found.append(f"fade: no way down from tick {first} on")
    attended = np.flatnonzero(~run.late[first:])
    due = attended[attended >= release - 1]
    if len(due) and (np.abs(forces[due[0] :]) > FAINT_N).any():
        found.append(f"fade: longer than the release, from tick {first} on")
    return found


def _too_steep(run: Run, first: int) -> list[str]:
    steps = np.linalg.norm(np.diff(run.forces_n[:first], axis=0, prepend=0.0), axis=1)
    limit = run.settings.limits.slew_n_per_s / run.rate_hz
    return [f"slew: {steps.max() * run.rate_hz:.1f} N/s"] if (steps > limit + ROUNDING_N).any() else []


def _pushed_outward(run: Run, share: FloatArray, first: int) -> list[str]:
    """A spring pulls towards its centre. Where the slew limit is at work, nothing is said of a single tick."""
    forces = run.forces_n
    steps = np.linalg.norm(np.diff(forces, axis=0, prepend=0.0), axis=1)
    free = ~run.late & (steps < 0.99 * run.settings.limits.slew_n_per_s / run.rate_hz)
    free &= np.linalg.norm(forces, axis=1) < 0.999 * run.settings.limits.total_cap_n
    free &= np.linalg.norm(forces, axis=1) > FAINT_N
    free[first:] = False
    away = np.where(free[:, None], run.readings_m - np.array(run.settings.place_m), 0.0)
    outward = np.einsum("ij,ij->i", forces - share, away) / np.maximum(np.linalg.norm(away, axis=1), 1e-12)
    wrong = free & (outward > _damper_bound(run) + ROUNDING_N)
    return [f"spring: pushes outward at tick {int(np.argmax(wrong))}"] if wrong.any() else []


def _jerk(run: Run, share: FloatArray, bound: FloatArray, first: int) -> list[str]:
    """Second differences, where no spring is and every tick was attended: those of the profile, and no more."""
    if bound.any() or run.late.any() or first < 3:
        return []
    stimulus = run.stimulus
    samples, slowest = stimulus.loop.samples, min(stimulus.fade_in_s, stimulus.fade_out_s) * run.rate_hz
    around = np.concatenate([samples[-2:], samples])
    one, two = (np.linalg.norm(np.diff(around, k, axis=0), axis=1).max() for k in (1, 2))
    most = np.linalg.norm(samples, axis=1).max()
    cosine = stimulus.fade_shape == "raised_cosine"
    slope = (math.pi / 2 if cosine else 1.0) / slowest
    bend = (math.pi / slowest) ** 2 / 2 if cosine else slope
    if _heard_at(run) < round(stimulus.fade_in_s * run.rate_hz):
        bend += slope  # released while it still rose: a corner
    promised = two + 2 * slope * one + 2 * bend * most
    jerk = np.linalg.norm(np.diff(run.forces_n[:first], 2, axis=0), axis=1)
    return [f"jerk: {jerk.max():.4g} N per tick², {promised:.4g} promised"] if (jerk > promised + 1e-9).any() else []


def _too_long(run: Run, norms: FloatArray, release: int) -> list[str]:
    limits, rate_hz = run.settings.limits, run.rate_hz
    fade_out = round(run.stimulus.fade_out_s * rate_hz)
    stalled_at = run.silent_from + round(limits.watchdog_s * rate_hz)
    released_by = _heard_at(run) + fade_out + release + 2
    last = {
        "watchdog": released_by if _heard_at(run) <= stalled_at < NEVER else stalled_at + release + 2,
        "longest hold": round(limits.longest_hold_s * rate_hz) + release + fade_out + 2,
        "release": released_by,
        "lie": run.told_by,
    }
    # A loop without signs of life holds its force: what is due is done at the next tick.
    asleep = int(run.late.sum()) if run.late.any() else 0
    return [f"late: a force after the {name}" for name, end in last.items() if norms[min(end + asleep, NEVER) :].any()]
