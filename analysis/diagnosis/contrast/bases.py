"""What describes a device in order, faults or not: forces along its motion where they hold, else its past."""

from contextlib import suppress

import numpy as np

from analysis.diagnosis.balance.motion import Motion, NoMotionError, motions_of
from analysis.diagnosis.contrast.force_base import force_base
from analysis.diagnosis.contrast.step_base import StepBase, likely_step
from analysis.diagnosis.contrast.stream import Base
from analysis.diagnosis.contrast.taken import Taken
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray

HOLDS = 0.35
"""Share of a force that a balance may leave to be one."""
STILL = 1e-4
"""Of its size: a command that changes by less is none."""
STILLER = 20.0
"""Times as far as the other set must one not move: what a device does at rest is foretold by no recording of its
motion. By hand: no fault of a sensor that can be undone makes as much."""
STEPS = 24
"""Past samples that tell of the next where no balance holds."""


def bases_of(clean: tuple[Taken, ...], faulty: tuple[Taken, ...]) -> tuple[list[Base], tuple[Motion, ...]]:
    """By forces, one per axis, where they hold on both sides (the faulty one may be empty); else step by step, one per
    response. And the motions of both sides, none where there are none."""
    recording = clean[0].recording
    turning = turning_of(recording)
    motions: tuple[Motion, ...] = ()
    with suppress(NoMotionError):
        first = motions_of([part.observed() for part in clean])
        more = motions_of([part.observed() for part in faulty], first[0].band_hz) if faulty else ()
        motions = (*first, *more)
    if motions and np.isfinite(motions[0].band_hz):
        bases: list[Base] = [force_base(motions, axis, turning) for axis in range(len(recording.command.channels))]
        if all(left_of(base, side) < HOLDS for base in bases for side in (clean, faulty) if side):
            return bases, motions
    step = likely_step((*clean, *faulty))
    return [StepBase(channel, STEPS, step) for channel in range(len(recording.response.channels))], motions


def moves_alike(clean: tuple[Taken, ...], faulty: tuple[Taken, ...]) -> bool:
    """Whether no response moves many times as far on one side as on the other, about the line that it drifts along."""
    sizes = np.array([np.sqrt(np.mean([_about_its_line(part) for part in side], axis=0)) for side in (clean, faulty)])
    return bool(np.all(sizes.max(axis=0) <= STILLER * sizes.min(axis=0)))


def _about_its_line(part: Taken) -> FloatArray:
    """(p,): mean squares."""
    at = np.arange(len(part.response)) - (len(part.response) - 1) / 2
    moved = part.response - part.response.mean(axis=0)
    return np.asarray(np.mean((moved - at[:, None] * (at @ moved / max(float(at @ at), 1.0))) ** 2, axis=0))


def turning_of(recording: Recording) -> bool:
    return any(unit.startswith(("rad", "N m")) for unit in (*recording.response.units, *recording.command.units))


def left_of(base: Base, parts: tuple[Taken, ...]) -> float:
    """Infinite where what is to be told never changes: then nothing can be told of it."""
    rows = np.vstack([part[mask] for part, mask in zip(base.rows(parts), base.valid_samples(parts), strict=True)])
    size = np.maximum(np.sqrt(np.mean(rows**2, axis=0)), 1e-300)
    spread = float(np.std(rows[:, 0]))
    if spread <= STILL * size[0]:
        return np.inf
    weights = np.linalg.lstsq(rows[:, 1:] / size[1:], rows[:, 0], rcond=1e-10)[0]
    return float(np.std(rows[:, 0] - rows[:, 1:] / size[1:] @ weights)) / spread
