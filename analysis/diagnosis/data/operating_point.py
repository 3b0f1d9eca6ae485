"""Adds the constant command of the operating point that a linear model lacks.

A linear model that was fitted to changes has no constants: neither the command at the operating point nor the zero of a
sensor. Without them, its simulation has an offset far larger than the errors of its dynamics.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from analysis.diagnosis.data.observed_parts import observed_parts
from equalizer.plant.mechanical_model import DERIVATIVE_OF_QUANTITY, MechanicalModel
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray

SOFTEST = 1e-6
"""Least ratio of the smallest to the largest stiffness for which a position is held at all."""


def about_operating_point(recordings: Sequence[Recording], model: MechanicalModel) -> tuple[Recording, ...] | None:
    """The recordings with a constant added to their commands, with which the model keeps the mean measured position of
    the fit samples. None where the response is not a position, or no stiffness holds it."""
    if DERIVATIVE_OF_QUANTITY[model.quantity] != 0:
        return None
    size = np.linalg.svd(model.stiffness, compute_uv=False)
    if size[-1] <= SOFTEST * size[0]:
        return None
    gain = model.output @ np.linalg.solve(model.stiffness, model.input)
    pushed, stood = _means(recordings, model.outputs)
    return add_to_commands(recordings, np.linalg.pinv(gain) @ stood - pushed)


def add_to_commands(recordings: Sequence[Recording], constant: FloatArray) -> tuple[Recording, ...]:
    """The recordings with a constant, (m,), added to every sample of their commands."""
    return tuple(
        replace(each, command=replace(each.command, samples=each.command.samples + constant)) for each in recordings
    )


def _means(recordings: Sequence[Recording], responses: int) -> tuple[FloatArray, FloatArray]:
    """Means of commands (m,) and responses (p,) over the samples to fit and to choose by."""
    records = observed_parts(recordings, responses)
    masks = [record.fit | record.choose for record in records]
    pushed = np.vstack([record.command[mask] for record, mask in zip(records, masks, strict=True)])
    stood = np.vstack([record.recording.response.samples[mask] for record, mask in zip(records, masks, strict=True)])
    return np.nanmean(pushed, axis=0), np.nanmean(stood, axis=0)
