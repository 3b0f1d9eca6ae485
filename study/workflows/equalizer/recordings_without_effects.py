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
from equalizer.tracking.compensation.effect_roles import explain_not_compensated
from equalizer.tracking.compensation.subtract_effects import subtract_effects
from study.errors import StudyError

TAIL_SHARE = 0.005
"""Largest fraction of the excitation's power that is left out below its band, and the same above it. Heuristic."""


def remove_effects(recordings: Sequence[Recording], physics: MechanicalModel, path: Path) -> tuple[Recording, ...]:
    """Remove the effects of `physics` from the recordings. path: file of the mechanical model, for messages. Raises
    StudyError if no effect can be removed, a recording has no excitation, or `subtract_effects` refuses one."""
    inputs = recordings[0].command.channels
    if not list_removable_effects(physics, inputs):
        reasons = " ".join(explain_unremovable_effects(physics, inputs))
        raise _make_not_removable_error(
            f"{path.name} names no effect that can be subtracted from a recording. {reasons}".rstrip()
        )
    try:
        return tuple(subtract_effects(recording, physics, find_excitation_band(recording)) for recording in recordings)
    except ValueError as problem:
        raise _make_not_removable_error(f"{path.name}: {problem}.") from problem


def list_removable_effects(physics: MechanicalModel, inputs: tuple[str, ...]) -> list[str]:
    """List the removable effects in words, each with its axis and its parameters or law. inputs: channels of the
    recordings' commands."""
    return [
        f"{effect.kind}{f' on {effect.axis}' if effect.axis else ''} ({_describe_parameters(effect)})"
        for effect in physics.effects
        if not explain_not_compensated(effect, inputs)
    ]


def explain_unremovable_effects(physics: MechanicalModel, inputs: tuple[str, ...]) -> tuple[str, ...]:
    """Explain, in a sentence for each, why effects stay in the recordings. inputs: channels of their commands."""
    reasons = ((effect.kind, explain_not_compensated(effect, inputs)) for effect in physics.effects)
    return tuple(f"{kind}: {reason}." for kind, reason in reasons if reason)


def _describe_parameters(effect: ModelEffect) -> str:
    """Describe the law of an effect without a name in the catalogue, or the names and values of its parameters."""
    if effect.law is not None:
        return effect.law.text
    return ", ".join(f"{name} {value:g}" for name, value in effect.parameters.items())


def find_excitation_band(recording: Recording) -> tuple[float, float]:
    """Find lower and upper end (Hz) of the band that holds at least 99 % of the excitation's power, or of the command's
    where no excitation is recorded. Missing samples (NaN) count as 0. Raises ValueError for a constant signal."""
    excitation = recording.excitation or recording.command
    samples = np.nan_to_num(excitation.samples)
    if not np.ptp(samples, axis=0).any():
        raise ValueError("a recording contains no excitation")
    power = (np.abs(np.fft.rfft(samples, axis=0)) ** 2).sum(axis=1)
    power[0] = 0.0  # a constant excites nothing
    limit_lines = np.searchsorted(np.cumsum(power) / power.sum(), (TAIL_SHARE, 1 - TAIL_SHARE))
    low_hz, high_hz = (float(line) * recording.sample_rate_hz / len(samples) for line in limit_lines)
    return low_hz, high_hz


def _make_not_removable_error(explanation: str) -> StudyError:
    """Make the error for recordings from which no effect can be subtracted."""
    return StudyError(
        "Known physics cannot be subtracted from the recordings",
        explanation,
        "Correct the [[effect]] sections, or leave out --physics.",
        saved="Nothing was written.",
    )
