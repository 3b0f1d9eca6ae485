"""Choice of the error measure for a search by simulation, and the constants that it may add to the commands.

A linear model that was fitted to deviations from the mean has no constants: neither the command at the operating point
nor the zero of a sensor. Without them, its simulation may have an offset far larger than the errors of its dynamics.
Therefore a constant may be added to the commands: for positions K x = B u at rest (`shift_to_operating_point`), for
forces the mean error (`shift_to_mean_force`). Called by `diagnose` and `force_balance_measures`.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from analysis.diagnosis.data.observed_parts import observe_parts
from analysis.diagnosis.errors.choose_measure import Compared, MeasureChoice, make_measure
from analysis.diagnosis.errors.fit_score import compute_fit_score
from analysis.diagnosis.errors.hypothesis import NO_EFFECTS
from analysis.diagnosis.errors.output_error import evaluate_fit
from analysis.diagnosis.errors.tuning import make_tuning
from analysis.diagnosis.forces.predicted_force import PredictedForce
from analysis.diagnosis.limits import CONSTANT_ERROR_RATIO
from equalizer.plant.mechanical_model import DERIVATIVE_OF_QUANTITY, MechanicalModel
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray

CONSTANT_ADDED = (
    "The fitted model contains no constants, so a constant was added to the command, for which the mean error on the "
    "fitted data is about zero. It includes weights, offsets of sensor and amplifier, and the operating point of the "
    "device."
)
"""Remark of a diagnosis whose measure has such a constant."""
LEAST_STIFFNESS_RATIO = 1e-6
"""Ratio of the smallest to the largest singular value of the stiffness above which it holds a position. Chosen."""


@dataclass(frozen=True, slots=True, eq=False)
class FittingMeasure:
    """A model, and the error measure of its fit."""

    model: MechanicalModel
    chosen: MeasureChoice
    is_narrow_band: bool = False
    """Whether the band is limited to small noise in the force, which may leave parameters of laws undetermined."""
    is_reduced: bool = False
    """Whether the force of further motions, modes and a delay was subtracted from the commands. Only set by
    `choose_forces_of_balance`."""


def choose_fitting_measure(
    recordings: Sequence[Recording],
    model: MechanicalModel,
    clean: Sequence[Recording],
    compared: Compared,
    about_mean: bool = False,
) -> FittingMeasure:
    """Choose the measure that `errors.choose_measure` selects. clean: recordings without the fault. compared: motion,
    force or automatic. about_mean: whether the model was fitted to deviations from the mean; without clean recordings,
    a constant is then added to the commands of a free simulation or predicted force, where the error over noise falls
    to `CONSTANT_ERROR_RATIO` of its value without the constant, or less."""
    fitting = FittingMeasure(model, make_measure(recordings, model, clean, compared))
    if not about_mean or clean:
        return fitting
    measure = fitting.chosen.measure
    shifted_recordings = None
    if measure.name == "free simulation":
        shifted_recordings = shift_to_operating_point(recordings, model)
    elif isinstance(measure, PredictedForce):
        shifted_recordings = shift_to_mean_force(recordings, model, measure)
    if shifted_recordings is None:
        return fitting
    shifted_choice = make_measure(shifted_recordings, model, clean, compared)
    if shifted_choice.measure.name != measure.name or _compute_error_over_noise(
        model, shifted_choice
    ) > CONSTANT_ERROR_RATIO * _compute_error_over_noise(model, fitting.chosen):
        return fitting
    return FittingMeasure(model, replace(shifted_choice, remarks=(*shifted_choice.remarks, CONSTANT_ADDED)))


def shift_to_mean_force(
    recordings: Sequence[Recording], model: MechanicalModel, measure: PredictedForce
) -> tuple[Recording, ...]:
    """Add a constant to the commands of the recordings, so that the mean error of the predicted force is zero over the
    samples to fit and to choose by."""
    residuals = measure.residuals(model, ())
    errors = np.concatenate(
        [residual[record.fit | record.choose] for residual, record in zip(residuals, measure.records, strict=True)]
    )
    return add_to_commands(recordings, -np.mean(errors, axis=0) * measure.unit)


def _compute_error_over_noise(model: MechanicalModel, chosen: MeasureChoice) -> float:
    """Compute the error of the unchanged model over the noise in its worst channel, on the samples to fit and to choose
    by."""
    measure = chosen.measure
    tuning = make_tuning(model, measure.records[0].recording.command.channels)
    nominal_fit = evaluate_fit(measure, tuning, np.zeros(len(tuning.names)), NO_EFFECTS)
    return compute_fit_score(measure, nominal_fit.residuals).worst_channel


def shift_to_operating_point(recordings: Sequence[Recording], model: MechanicalModel) -> tuple[Recording, ...] | None:
    """Add to the commands of the recordings the constant u = pinv(C K^-1 B) mean(y) - mean(command), for which the
    model at rest is at the mean measured position; means over the samples to fit and to choose by. None where the
    response is not a position, or no stiffness holds it."""
    if DERIVATIVE_OF_QUANTITY[model.quantity] != 0:
        return None
    singular_values = np.linalg.svd(model.stiffness, compute_uv=False)
    if singular_values[-1] <= LEAST_STIFFNESS_RATIO * singular_values[0]:
        return None
    gain = model.output @ np.linalg.solve(model.stiffness, model.input)
    mean_command, mean_response = _compute_means(recordings, model.outputs)
    return add_to_commands(recordings, np.linalg.pinv(gain) @ mean_response - mean_command)


def add_to_commands(recordings: Sequence[Recording], constant: FloatArray) -> tuple[Recording, ...]:
    """Add a constant (m,) to every sample of the commands."""
    return tuple(
        replace(recording, command=replace(recording.command, samples=recording.command.samples + constant))
        for recording in recordings
    )


def _compute_means(recordings: Sequence[Recording], responses: int) -> tuple[FloatArray, FloatArray]:
    """Compute the means of commands (m,) and responses (p,) over the samples to fit and to choose by. responses: number
    of response channels."""
    records = observe_parts(recordings, responses)
    masks = [record.fit | record.choose for record in records]
    commands = np.vstack([record.command[mask] for record, mask in zip(records, masks, strict=True)])
    response_samples = np.vstack(
        [record.recording.response.samples[mask] for record, mask in zip(records, masks, strict=True)]
    )
    return np.nanmean(commands, axis=0), np.nanmean(response_samples, axis=0)
