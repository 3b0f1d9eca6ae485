"""The error measures by the parameters of force balances: for the laws that they name, and where they name none."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from analysis.diagnosis.balance.judge_laws import Balance
from analysis.diagnosis.confirm.fitting_measures import ABOUT_MEAN, FittingMeasure, about_mean_force
from analysis.diagnosis.data.measured_motion import is_quasi_static, is_read_as_free
from analysis.diagnosis.errors.choose_measure import Compared, MeasureChoice, measure_by_force, measure_of
from analysis.diagnosis.first_model.model_from_balance import first_model, share_within
from analysis.diagnosis.first_model.reduced_recordings import is_reduced, reduce_recordings
from analysis.diagnosis.forces.predicted_force import PredictedForce
from analysis.diagnosis.settings import LAWS_WITHIN
from equalizer.plant.mechanical_model import MechanicalModel, MechanicalModelError
from equalizer.signals.recording import Recording

BALANCE_LEAVES_LESS = (
    "Forces are predicted with the linear parameters of the force balance and a constant: they leave less of the "
    "forces than the model that was fitted to spectra."
)


def list_fitting_measures(
    recordings: Sequence[Recording], model: MechanicalModel, balances: Sequence[Balance], compared: Compared
) -> Iterator[FittingMeasure]:
    """The measures to try, the strictest first: a free simulation where the fitted model allows one; then forces along
    the measured motion with the balance's linear parameters, in the band where noise is small, if it holds the laws'
    power, and in the band of the balance."""
    if not any(balance.named for balance in balances):
        return
    chosen = measure_of(recordings, model)
    if is_quasi_static(recordings[0]) or is_read_as_free(recordings[0]):
        yield FittingMeasure(model, chosen)
        return
    if (chosen.measure.name == "free simulation" or chosen.measure.name.startswith("windows")) and compared != "force":
        yield FittingMeasure(model, chosen)
    if compared == "motion":
        return
    try:
        reduced, rigid = _model_of_balances(recordings, balances, model.name)
        if rigid is not None:
            narrow = measure_by_force(reduced, rigid, None)
            held = share_within(balances, narrow.measure.band_hz) if isinstance(narrow.measure, PredictedForce) else 0.0
            if held >= LAWS_WITHIN:
                yield FittingMeasure(rigid, narrow, narrow=True)
            yield FittingMeasure(
                rigid, measure_by_force(reduced, rigid, balances[0].search.regression.motions[0].band_hz)
            )
    except (MechanicalModelError, np.linalg.LinAlgError):
        return


def choose_plain_forces(
    recordings: Sequence[Recording], fitting: FittingMeasure, balances: Sequence[Balance]
) -> FittingMeasure:
    """Where forces are compared and no law is named: the balance's own linear parameters in place of the fitted
    model's, where these leave more of the forces, on the samples to fit and to choose by. A model that was fitted to
    spectra in closed loop may need modes that the measured motions of a second body make unnecessary."""
    measure = fitting.chosen.measure
    named, first = any(balance.named for balance in balances), recordings[0]
    if not balances or named or is_quasi_static(first) or is_read_as_free(first):
        return fitting
    if not isinstance(measure, PredictedForce):
        return fitting
    try:
        reduced, plain = _model_of_balances(recordings, balances, fitting.model.name)
        if plain is None:
            return fitting
        chosen = _predict_about_mean(reduced, plain, measure.band_hz)
    except (MechanicalModelError, np.linalg.LinAlgError):
        return fitting
    other = chosen.measure
    if not isinstance(other, PredictedForce) or not _leaves_less((plain, other), (fitting.model, measure)):
        return fitting
    remarks = tuple(remark for remark in fitting.chosen.remarks if remark != ABOUT_MEAN)
    chosen = replace(chosen, remarks=(*remarks, BALANCE_LEAVES_LESS))
    return FittingMeasure(plain, chosen, is_reduced=is_reduced(balances))


def _model_of_balances(
    recordings: Sequence[Recording], balances: Sequence[Balance], name: str
) -> tuple[Sequence[Recording], MechanicalModel | None]:
    """The recordings with one body per command, and the balances' linear model of it; None where there is none."""
    reduced = reduce_recordings(recordings, balances) if is_reduced(balances) else recordings
    return reduced, first_model(balances, reduced[0], name)


def _predict_about_mean(recordings: Sequence[Recording], model: MechanicalModel, band_hz: float) -> MeasureChoice:
    """The measure by force with a constant command that makes the mean error zero: the balance, too, has one."""
    chosen = measure_by_force(recordings, model, band_hz)
    if not isinstance(chosen.measure, PredictedForce):
        return chosen
    return measure_by_force(about_mean_force(recordings, model, chosen.measure), model, band_hz)


Prediction = tuple[MechanicalModel, PredictedForce]


def _leaves_less(plain: Prediction, given: Prediction) -> bool:
    """Whether the forces that a model needs are closer to the commands than another's, in the rms over the axes, each
    over the rms of its command, on the samples to fit and to choose by of both."""
    kept = [
        (ours.fit | ours.choose) & (other.fit | other.choose)
        for ours, other in zip(plain[1].records, given[1].records, strict=True)
    ]
    forces = np.vstack([record.command[mask] for record, mask in zip(given[1].records, kept, strict=True)])
    size = np.sqrt(np.mean(forces**2, axis=0))
    driven = size > 0
    missed = []
    for model, measure in (plain, given):
        left = [each[mask] for each, mask in zip(measure.residuals(model, ()), kept, strict=True)]
        missed.append(np.mean((np.vstack(left) * measure.unit)[:, driven] ** 2 / size[driven] ** 2))
    return bool(missed[0] < missed[1])
