"""Error measures for a model whose mass, damping and stiffness come from the force balance.

An error measure says how a model is compared with a recording (free simulation, simulation in windows, force predicted
along the measured motion) and in which band. A force balance is a linear regression of the commanded force on the
measured motion: M a + B v + K x + laws = command (`analysis.diagnosis.balance`). Where no model was given, there are
two linear models: one fitted to spectra, and that of the balance. Where the balance names laws, this file lists the
measures in which those laws may be fitted and confirmed. Where it names none, the model of the balance replaces the
model fitted to spectra if it predicts the forces with a smaller error. Called by `diagnose`.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from analysis.diagnosis.balance.judge_laws import Balance
from analysis.diagnosis.confirm.fitting_measures import CONSTANT_ADDED, FittingMeasure, shift_to_mean_force
from analysis.diagnosis.data.measured_motion import is_free_motion, is_quasi_static
from analysis.diagnosis.errors.choose_measure import Compared, MeasureChoice, make_force_measure, make_measure
from analysis.diagnosis.first_model.model_from_balance import build_first_model, compute_law_power_share
from analysis.diagnosis.first_model.reduced_recordings import is_reduction_needed, reduce_recordings
from analysis.diagnosis.forces.predicted_force import PredictedForce
from analysis.diagnosis.limits import LAW_BAND_POWER_SHARE
from equalizer.plant.mechanical_model import MechanicalModel, MechanicalModelError
from equalizer.signals.recording import Recording

BALANCE_PREDICTS_BETTER = (
    "Forces are predicted with the linear parameters of the force balance and a constant, because this gives a "
    "smaller error than the model that was fitted to spectra."
)
"""Remark of a diagnosis whose model of the force balance replaced the model fitted to spectra."""


def list_fitting_measures(
    recordings: Sequence[Recording], model: MechanicalModel, balances: Sequence[Balance], compared: Compared
) -> Iterator[FittingMeasure]:
    """Yield the measures to try for the laws that the balances name, the strictest first; none where no law is named.

    A recording without a time axis, or of a free motion, has a single measure. Else first a free simulation, or a
    simulation in windows, where the fitted model allows it. Then the force predicted along the measured motion with the
    linear parameters of the balances: in the band where noise is small, if that contains at least
    `LAW_BAND_POWER_SHARE` of each law's power, and in the band of the balances. compared: "motion" or "force" restricts
    the latter measures to that quantity."""
    if not any(balance.named for balance in balances):
        return
    motion_choice = make_measure(recordings, model)
    if is_quasi_static(recordings[0]) or is_free_motion(recordings[0]):
        yield FittingMeasure(model, motion_choice)
        return
    if (
        motion_choice.measure.name == "free simulation" or motion_choice.measure.name.startswith("windows")
    ) and compared != "force":
        yield FittingMeasure(model, motion_choice)
    if compared == "motion":
        return
    try:
        reduced_recordings, linear_model = _build_model_of_balances(recordings, balances, model.name)
        if linear_model is not None:
            narrow_band_choice = make_force_measure(reduced_recordings, linear_model, None)
            power_share = 0.0
            if isinstance(narrow_band_choice.measure, PredictedForce):
                power_share = compute_law_power_share(balances, narrow_band_choice.measure.band_hz)
            if power_share >= LAW_BAND_POWER_SHARE:
                yield FittingMeasure(linear_model, narrow_band_choice, is_narrow_band=True)
            band_hz = balances[0].search.regression.motions[0].band_hz
            yield FittingMeasure(linear_model, make_force_measure(reduced_recordings, linear_model, band_hz))
    except (MechanicalModelError, np.linalg.LinAlgError):
        return  # the balances' parameters make no model, or none that can be inverted: nothing more can be tried


def choose_forces_of_balance(
    recordings: Sequence[Recording], fitting_measure: FittingMeasure, balances: Sequence[Balance]
) -> FittingMeasure:
    """Choose the measure with the linear parameters of the balances if it predicts the forces better; else
    `fitting_measure` unchanged, also where these parameters make no model.

    It can replace `fitting_measure` only where forces are compared and no law is named. Better: a smaller error on the
    samples to fit and to choose by (`_predicts_better`).
    """
    fitted_measure = fitting_measure.chosen.measure
    has_named_law, first_recording = any(balance.named for balance in balances), recordings[0]
    if not balances or has_named_law or is_quasi_static(first_recording) or is_free_motion(first_recording):
        return fitting_measure
    if not isinstance(fitted_measure, PredictedForce):
        return fitting_measure
    try:
        reduced_recordings, balance_model = _build_model_of_balances(recordings, balances, fitting_measure.model.name)
        if balance_model is None:
            return fitting_measure
        balance_choice = _predict_about_mean(reduced_recordings, balance_model, fitted_measure.band_hz)
    except (MechanicalModelError, np.linalg.LinAlgError):
        return fitting_measure
    balance_measure = balance_choice.measure
    if not isinstance(balance_measure, PredictedForce) or not _predicts_better(
        (balance_model, balance_measure), (fitting_measure.model, fitted_measure)
    ):
        return fitting_measure
    remarks = tuple(remark for remark in fitting_measure.chosen.remarks if remark != CONSTANT_ADDED)
    balance_choice = replace(balance_choice, remarks=(*remarks, BALANCE_PREDICTS_BETTER))
    return FittingMeasure(balance_model, balance_choice, is_reduced=is_reduction_needed(balances))


def _build_model_of_balances(
    recordings: Sequence[Recording], balances: Sequence[Balance], name: str
) -> tuple[Sequence[Recording], MechanicalModel | None]:
    """Reduce the recordings to one body per command where needed, and build their linear model with the balances'
    parameters; None in place of the model where these make none. name: of the model."""
    reduced_recordings = reduce_recordings(recordings, balances) if is_reduction_needed(balances) else recordings
    return reduced_recordings, build_first_model(balances, reduced_recordings[0], name)


def _predict_about_mean(recordings: Sequence[Recording], model: MechanicalModel, band_hz: float) -> MeasureChoice:
    """Make the measure by force with a constant command that makes the mean error zero, because the regression of the
    balance has a constant, too. band_hz: upper end of the band in Hz."""
    choice = make_force_measure(recordings, model, band_hz)
    if not isinstance(choice.measure, PredictedForce):
        return choice
    return make_force_measure(shift_to_mean_force(recordings, model, choice.measure), model, band_hz)


ModelWithMeasure = tuple[MechanicalModel, PredictedForce]
"""A model, and the measure by which its predicted forces are compared with the commands."""


def _predicts_better(balance_prediction: ModelWithMeasure, fitted_prediction: ModelWithMeasure) -> bool:
    """Whether the model of the balance predicts the commands with a smaller error than the fitted model.

    The error is the mean over axes of (mean square of predicted force minus command) / (mean square of the command),
    over the samples to fit and to choose by of both measures; axes without a command are left out.
    """
    masks = [
        (balance_record.fit | balance_record.choose) & (fitted_record.fit | fitted_record.choose)
        for balance_record, fitted_record in zip(
            balance_prediction[1].records, fitted_prediction[1].records, strict=True
        )
    ]
    commands = np.vstack(
        [record.command[mask] for record, mask in zip(fitted_prediction[1].records, masks, strict=True)]
    )
    command_power = np.mean(commands**2, axis=0)
    is_driven = command_power > 0
    error_shares = []
    for model, measure in (balance_prediction, fitted_prediction):
        masked_residuals = [residual[mask] for residual, mask in zip(measure.residuals(model, ()), masks, strict=True)]
        errors = np.vstack(masked_residuals) * measure.unit
        error_shares.append(np.mean(errors[:, is_driven] ** 2 / command_power[is_driven]))
    return bool(error_shares[0] < error_shares[1])
