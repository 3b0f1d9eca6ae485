"""Error measures for a model whose mass, damping and stiffness come from the force balance.

An error measure says how a model is compared with a recording (free simulation, simulation in windows, force predicted
along the measured motion) and in which band. A force balance is a linear regression of the commanded force on the
measured motion: M a + B v + K x + laws = command (`analysis.diagnosis.balance`). Where no model was given, there are
two linear models: one fitted to spectra, and that of the balance. Where the balance names laws, this file lists the
measures in which those laws may be fitted and confirmed. Where it names none, the model of the balance replaces the
model fitted to spectra if it predicts the forces with a smaller error.
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
from analysis.diagnosis.settings import LAWS_WITHIN
from equalizer.plant.mechanical_model import MechanicalModel, MechanicalModelError
from equalizer.signals.recording import Recording

BALANCE_PREDICTS_BETTER = (
    "Forces are predicted with the linear parameters of the force balance and a constant, because this gives a "
    "smaller error than the model that was fitted to spectra."
)


def list_fitting_measures(
    recordings: Sequence[Recording], model: MechanicalModel, balances: Sequence[Balance], compared: Compared
) -> Iterator[FittingMeasure]:
    """The measures to try for the laws that the balances name, the strictest first; none where no law is named.

    First a free simulation, or a simulation in windows, where the fitted model allows it. Then the force predicted
    along the measured motion with the linear parameters of the balances: in the band where noise is small, if that
    holds most of the laws' power, and in the band of the balances. compared: "motion" or "force" restricts the measures
    to that quantity.
    """
    if not any(balance.named for balance in balances):
        return
    chosen = make_measure(recordings, model)
    if is_quasi_static(recordings[0]) or is_free_motion(recordings[0]):
        yield FittingMeasure(model, chosen)
        return
    if (chosen.measure.name == "free simulation" or chosen.measure.name.startswith("windows")) and compared != "force":
        yield FittingMeasure(model, chosen)
    if compared == "motion":
        return
    try:
        reduced, linear = _model_of_balances(recordings, balances, model.name)
        if linear is not None:
            narrow = make_force_measure(reduced, linear, None)
            power_share = 0.0
            if isinstance(narrow.measure, PredictedForce):
                power_share = compute_law_power_share(balances, narrow.measure.band_hz)
            if power_share >= LAWS_WITHIN:
                yield FittingMeasure(linear, narrow, narrow=True)
            band_hz = balances[0].search.regression.motions[0].band_hz
            yield FittingMeasure(linear, make_force_measure(reduced, linear, band_hz))
    except (MechanicalModelError, np.linalg.LinAlgError):
        return  # the balances' parameters make no model, or none that can be inverted: nothing more can be tried


def choose_forces_of_balance(
    recordings: Sequence[Recording], fitting: FittingMeasure, balances: Sequence[Balance]
) -> FittingMeasure:
    """The measure with the linear parameters of the balances, if it predicts the forces better; else `fitting`
    unchanged.

    It can replace `fitting` only where forces are compared and no law is named. Better: a smaller error on the samples
    to fit and to choose by. A model fitted to spectra in closed loop may need modes that are unnecessary where the
    motion of a second body is measured.
    """
    given_measure = fitting.chosen.measure
    has_named_law, first = any(balance.named for balance in balances), recordings[0]
    if not balances or has_named_law or is_quasi_static(first) or is_free_motion(first):
        return fitting
    if not isinstance(given_measure, PredictedForce):
        return fitting
    try:
        reduced, linear = _model_of_balances(recordings, balances, fitting.model.name)
        if linear is None:
            return fitting
        chosen = _predict_about_mean(reduced, linear, given_measure.band_hz)
    except (MechanicalModelError, np.linalg.LinAlgError):
        return fitting
    measure = chosen.measure
    if not isinstance(measure, PredictedForce) or not _predicts_better(
        (linear, measure), (fitting.model, given_measure)
    ):
        return fitting
    remarks = tuple(remark for remark in fitting.chosen.remarks if remark != CONSTANT_ADDED)
    chosen = replace(chosen, remarks=(*remarks, BALANCE_PREDICTS_BETTER))
    return FittingMeasure(linear, chosen, is_reduced=is_reduction_needed(balances))


def _model_of_balances(
    recordings: Sequence[Recording], balances: Sequence[Balance], name: str
) -> tuple[Sequence[Recording], MechanicalModel | None]:
    """The recordings with one body per command, and the linear model that the balances' parameters make of it; None
    where they make no model."""
    reduced = reduce_recordings(recordings, balances) if is_reduction_needed(balances) else recordings
    return reduced, build_first_model(balances, reduced[0], name)


def _predict_about_mean(recordings: Sequence[Recording], model: MechanicalModel, band_hz: float) -> MeasureChoice:
    """The measure by force with a constant command that makes the mean error zero, because the regression of the
    balance has a constant, too."""
    chosen = make_force_measure(recordings, model, band_hz)
    if not isinstance(chosen.measure, PredictedForce):
        return chosen
    return make_force_measure(shift_to_mean_force(recordings, model, chosen.measure), model, band_hz)


Prediction = tuple[MechanicalModel, PredictedForce]
"""A model, and the measure by which its predicted forces are compared with the commands."""


def _predicts_better(linear: Prediction, given: Prediction) -> bool:
    """Whether the model of the balance (`linear`) predicts the commands with a smaller error than the given one.

    The error is mean over axes of (power of predicted force minus command) / (power of the command), over the samples
    to fit and to choose by of both measures; axes without a command are left out.
    """
    masks = [
        (linear_record.fit | linear_record.choose) & (given_record.fit | given_record.choose)
        for linear_record, given_record in zip(linear[1].records, given[1].records, strict=True)
    ]
    commands = np.vstack([record.command[mask] for record, mask in zip(given[1].records, masks, strict=True)])
    power = np.mean(commands**2, axis=0)
    driven = power > 0
    shares = []
    for model, measure in (linear, given):
        parts = [part[mask] for part, mask in zip(measure.residuals(model, ()), masks, strict=True)]
        errors = np.vstack(parts) * measure.unit
        shares.append(np.mean(errors[:, driven] ** 2 / power[driven]))
    return bool(shares[0] < shares[1])
