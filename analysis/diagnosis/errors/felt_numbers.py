"""Which of a model's numbers a force at an axis can feel: those that change how that axis moves."""

import numpy as np

from analysis.diagnosis.errors.error_measure import ErrorMeasure
from analysis.diagnosis.errors.hypothesis import Hypothesis
from analysis.diagnosis.errors.output_error import Sensitivity
from analysis.diagnosis.errors.tuning import Tuning
from equalizer.effects.effect import AxisForce, JointForce
from equalizer.signals.signal import FloatArray

FELT = 0.06
"""Change of an axis's channel, as a share of the largest that any number makes there."""


def felt_numbers(measure: ErrorMeasure, tuning: Tuning, plain: Sensitivity, hypothesis: Hypothesis) -> list[int]:
    """plain: what the numbers do where no force depends on the motion. What hardly moves the axes at which such forces
    act does the same beside them."""
    forces = [one for one in hypothesis.placed() if isinstance(one.effect.acts, (AxisForce, JointForce))]
    model = tuning.tuned(np.zeros(len(tuning.names)))
    if not forces or any(isinstance(one.effect.acts, JointForce) for one in forces):
        return list(range(len(tuning.names)))
    reached = np.abs(model.output @ np.linalg.solve(model.mass, model.input))
    sites = {site for one in forces for site in one.sites}
    strength = _strengths(measure, plain.columns, model.outputs)
    felt = np.zeros(len(tuning.names), dtype=bool)
    for site in sites:
        in_channel = strength[:, int(np.argmax(reached[:, site]))]
        felt |= in_channel > FELT * in_channel.max(initial=0.0)
    return np.flatnonzero(felt).tolist()


def _strengths(measure: ErrorMeasure, columns: FloatArray, outputs: int) -> FloatArray:
    """(t, p): rms in each response channel."""
    squares, first = np.zeros((len(columns), outputs)), 0
    for record in measure.records:
        count, channels = int(record.fit.sum()), record.measured.shape[1]
        part = columns[:, first : first + count * channels].reshape(len(columns), count, channels)[:, :, :outputs]
        squares += np.einsum("tnc,tnc->tc", part, part)
        first += count * channels
    return np.sqrt(squares)
