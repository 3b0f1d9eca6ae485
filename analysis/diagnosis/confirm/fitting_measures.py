"""Chooses the error measures in which the laws of a force balance are fitted, one after the other.

A linear model that was fitted to deviations from the mean has no constants: neither the command at the operating point
nor the zero of a sensor. Without them, its simulation has an offset far larger than the errors of its dynamics.
Therefore a constant is added to the commands: for positions K x = B u at rest (`about_operating_point`), for forces the
mean error (`about_mean_force`).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from analysis.diagnosis.data.observed_parts import observe_parts
from analysis.diagnosis.errors.choose_measure import Compared, MeasureChoice, measure_of
from analysis.diagnosis.errors.fit_score import fit_score
from analysis.diagnosis.errors.hypothesis import NOTHING
from analysis.diagnosis.errors.output_error import evaluate_fit
from analysis.diagnosis.errors.tuning import tuning_of
from analysis.diagnosis.forces.predicted_force import PredictedForce
from analysis.diagnosis.settings import CONSTANT_LEAVES
from equalizer.plant.mechanical_model import DERIVATIVE_OF_QUANTITY, MechanicalModel
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray

ABOUT_MEAN = (
    "The fitted model contains no constants, so a constant was added to the command that makes the mean error on the "
    "fitted data zero. It includes weights, offsets of sensor and amplifier, and the operating point of the device."
)


@dataclass(frozen=True, slots=True, eq=False)
class FittingMeasure:
    """A model, and the error measure of its fit."""

    model: MechanicalModel
    chosen: MeasureChoice
    narrow: bool = False
    """Whether the band is limited to small noise in the force, which may leave parameters of laws undetermined."""
    is_reduced: bool = False
    """Whether the force of further motions, modes and a delay was subtracted from the commands."""


def choose_fitting_measure(
    recordings: Sequence[Recording],
    model: MechanicalModel,
    clean: Sequence[Recording],
    compared: Compared,
    about_mean: bool = False,
) -> FittingMeasure:
    """The measure that `errors.choose_measure` selects. clean: recordings without the fault. compared: motion, force or
    automatic. about_mean: the model was fitted to deviations from the mean, and a constant command is added where that
    lowers the error."""
    fitting = FittingMeasure(model, measure_of(recordings, model, clean, compared))
    if not about_mean or clean:
        return fitting
    measure = fitting.chosen.measure
    moved = None
    if measure.name == "free simulation":
        moved = about_operating_point(recordings, model)
    elif isinstance(measure, PredictedForce):
        moved = about_mean_force(recordings, model, measure)
    if moved is None:
        return fitting
    other = measure_of(moved, model, clean, compared)
    if other.measure.name != measure.name or _error_over_noise(model, other) > CONSTANT_LEAVES * _error_over_noise(
        model, fitting.chosen
    ):
        return fitting
    return FittingMeasure(model, replace(other, remarks=(*other.remarks, ABOUT_MEAN)))


def about_mean_force(
    recordings: Sequence[Recording], model: MechanicalModel, measure: PredictedForce
) -> tuple[Recording, ...]:
    """The recordings with a constant added to their commands, so that the mean error of the predicted force is zero
    over the samples to fit and to choose by."""
    residuals = measure.residuals(model, ())
    missed = np.concatenate(
        [left[record.fit | record.choose] for left, record in zip(residuals, measure.records, strict=True)]
    )
    return add_to_commands(recordings, -np.mean(missed, axis=0) * measure.unit)


def _error_over_noise(model: MechanicalModel, chosen: MeasureChoice) -> float:
    """Error of the unchanged model over the noise, on the samples to fit and to choose by."""
    measure = chosen.measure
    tuning = tuning_of(model, measure.records[0].recording.command.channels)
    given = evaluate_fit(measure, tuning, np.zeros(len(tuning.names)), NOTHING)
    return fit_score(measure, given.residuals).worst_channel


LEAST_STIFFNESS_RATIO = 1e-6
"""Least ratio of the smallest to the largest singular value of the stiffness at which a position is held. By hand."""


def about_operating_point(recordings: Sequence[Recording], model: MechanicalModel) -> tuple[Recording, ...] | None:
    """The recordings with a constant added to their commands, for which the model at rest is at the mean measured
    position: u = pinv(C K^-1 B) mean(y) - mean(command), over the samples to fit and to choose by. None where the
    response is not a position, or no stiffness holds it."""
    if DERIVATIVE_OF_QUANTITY[model.quantity] != 0:
        return None
    size = np.linalg.svd(model.stiffness, compute_uv=False)
    if size[-1] <= LEAST_STIFFNESS_RATIO * size[0]:
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
    records = observe_parts(recordings, responses)
    masks = [record.fit | record.choose for record in records]
    pushed = np.vstack([record.command[mask] for record, mask in zip(records, masks, strict=True)])
    stood = np.vstack([record.recording.response.samples[mask] for record, mask in zip(records, masks, strict=True)])
    return np.nanmean(pushed, axis=0), np.nanmean(stood, axis=0)
