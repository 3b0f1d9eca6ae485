"""Recordings freed of the effects that a mechanical model names, so that a model of the linear rest is made of them."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from equalizer.plant.mechanical_model import MechanicalModel, ModelEffect
from equalizer.signals.recording import Recording
from equalizer.tracking.compensation.effect_roles import why_not
from equalizer.tracking.compensation.without_effects import without_effects
from study.errors import StudyError

LEFT_OUT = 0.005
"""Of the excitation's power, below the band that it is said to fill, and above."""


def freed_recordings(recordings: Sequence[Recording], physics: MechanicalModel, path: Path) -> tuple[Recording, ...]:
    """path: of the mechanical model, for what is said. Raises StudyError where it names nothing that can be taken off,
    or where a recording does not show the motion."""
    if not freed_of(physics):
        left = "".join(f" {effect.kind}: {why_not(effect)}." for effect in physics.effects)
        raise _not_freed(f"{path.name} names no effect that can be taken off a recording.{left}")
    try:
        return tuple(without_effects(recording, physics, excited_band_hz(recording)) for recording in recordings)
    except ValueError as problem:
        raise _not_freed(f"{path.name}: {problem}.") from problem


def freed_of(physics: MechanicalModel) -> list[str]:
    """What is taken off, in words."""
    return [
        f"{effect.kind}{f' on {effect.axis}' if effect.axis else ''} ({_numbers(effect)})"
        for effect in physics.effects
        if not why_not(effect)
    ]


def _numbers(effect: ModelEffect) -> str:
    if effect.law is not None:
        return effect.law.text
    return ", ".join(f"{name} {value:g}" for name, value in effect.parameters.items())


def excited_band_hz(recording: Recording) -> tuple[float, float]:
    """Where all but a hundredth of the power of what was decided beforehand lies."""
    driven = recording.excitation or recording.command
    samples = np.nan_to_num(driven.samples)
    if not np.ptp(samples, axis=0).any():
        raise ValueError("a recording holds no excitation")
    power = (np.abs(np.fft.rfft(samples, axis=0)) ** 2).sum(axis=1)
    power[0] = 0.0  # a constant excites nothing
    lines = np.searchsorted(np.cumsum(power) / power.sum(), (LEFT_OUT, 1 - LEFT_OUT))
    low, high = (float(line) * recording.sample_rate_hz / len(samples) for line in lines)
    return low, high


def _not_freed(happened: str) -> StudyError:
    return StudyError(
        "The recordings cannot be freed of known physics",
        happened,
        "Correct the [[effect]] sections, or leave out --physics.",
        saved="Nothing was written.",
    )
