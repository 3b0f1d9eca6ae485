"""Remove known effects, such as friction, from recordings, so that a linear model of the remainder can be identified.

Effects that act on the command are applied to it, and the forces of other effects along the measured motion are
subtracted from it (`equalizer.tracking.compensation.subtract_effects`). Effects that cannot be removed stay in the
recordings.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from equalizer.plant.mechanical_model import MechanicalModel, ModelEffect
from equalizer.signals.recording import Recording
from equalizer.tracking.compensation.effect_roles import reason_not_compensated
from equalizer.tracking.compensation.subtract_effects import subtract_effects
from study.errors import StudyError

LEFT_OUT = 0.005
"""Fraction of the excitation's power that is left out below its band, and the same above it. Heuristic."""


def remove_effects(recordings: Sequence[Recording], physics: MechanicalModel, path: Path) -> tuple[Recording, ...]:
    """The recordings without the effects of `physics`. path: file of the mechanical model, for messages. Raises
    StudyError if no effect can be removed, or a recording has no excitation, missing samples, or a response that is not
    the acceleration of each command."""
    if not removable_effects(physics):
        left = " ".join(reasons_not_removed(physics))
        raise _not_removable(f"{path.name} names no effect that can be subtracted from a recording. {left}".rstrip())
    try:
        return tuple(subtract_effects(recording, physics, excitation_band_hz(recording)) for recording in recordings)
    except ValueError as problem:
        raise _not_removable(f"{path.name}: {problem}.") from problem


def removable_effects(physics: MechanicalModel) -> list[str]:
    """The removable effects in words, each with its axis and its parameters or law."""
    return [
        f"{effect.kind}{f' on {effect.axis}' if effect.axis else ''} ({_numbers(effect)})"
        for effect in physics.effects
        if not reason_not_compensated(effect)
    ]


def reasons_not_removed(physics: MechanicalModel) -> tuple[str, ...]:
    """A sentence for each effect that stays in the recordings."""
    reasons = ((effect.kind, reason_not_compensated(effect)) for effect in physics.effects)
    return tuple(f"{kind}: {reason}." for kind, reason in reasons if reason)


def _numbers(effect: ModelEffect) -> str:
    if effect.law is not None:
        return effect.law.text
    return ", ".join(f"{name} {value:g}" for name, value in effect.parameters.items())


def excitation_band_hz(recording: Recording) -> tuple[float, float]:
    """Lower and upper end (Hz) of the band that holds 99 % of the excitation's power, or of the command's where no
    excitation is recorded. Raises ValueError for a constant signal."""
    driven = recording.excitation or recording.command
    samples = np.nan_to_num(driven.samples)
    if not np.ptp(samples, axis=0).any():
        raise ValueError("a recording contains no excitation")
    power = (np.abs(np.fft.rfft(samples, axis=0)) ** 2).sum(axis=1)
    power[0] = 0.0  # a constant excites nothing
    lines = np.searchsorted(np.cumsum(power) / power.sum(), (LEFT_OUT, 1 - LEFT_OUT))
    low, high = (float(line) * recording.sample_rate_hz / len(samples) for line in lines)
    return low, high


def _not_removable(happened: str) -> StudyError:
    return StudyError(
        "Known physics cannot be subtracted from the recordings",
        happened,
        "Correct the [[effect]] sections, or leave out --physics.",
        saved="Nothing was written.",
    )
