"""The error measures by the numbers of force balances: for the laws that they name, and where they name none."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from analysis.diagnosis.balance.judge_laws import Balance
from analysis.diagnosis.confirm.fitting_measures import FittingMeasure
from analysis.diagnosis.data.measured_motion import is_quasi_static, is_read_as_free
from analysis.diagnosis.errors.choose_measure import Compared, measure_by_force, measure_of
from analysis.diagnosis.first_model.model_from_balance import first_model, share_within
from analysis.diagnosis.first_model.reduced_recordings import is_reduced, reduce_recordings
from analysis.diagnosis.forces.predicted_force import PredictedForce
from analysis.diagnosis.settings import LAWS_WITHIN
from equalizer.plant.mechanical_model import MechanicalModel, MechanicalModelError
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray

BALANCE_LEAVES_LESS = (
    "Forces are predicted with the linear parameters of the force balance: they leave less of the forces than the "
    "model that was fitted to spectra."
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
        reduced = reduce_recordings(recordings, balances) if is_reduced(balances) else recordings
        rigid = first_model(balances, reduced[0], model.name)
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
    named = any(balance.named for balance in balances)
    if not balances or named or not isinstance(measure, PredictedForce):
        return fitting
    try:
        reduced = reduce_recordings(recordings, balances) if is_reduced(balances) else recordings
        plain = first_model(balances, reduced[0], fitting.model.name)
        if plain is None:
            return fitting
        other = measure_by_force(reduced, plain, measure.band_hz)
    except (MechanicalModelError, np.linalg.LinAlgError):
        return fitting
    if not isinstance(other.measure, PredictedForce):
        return fitting
    forces = np.vstack([record.command[record.fit | record.choose] for record in measure.records])
    size = np.maximum(np.sqrt(np.mean(forces**2, axis=0)), 1e-300)
    if not _missed_force(plain, other.measure, size) < _missed_force(fitting.model, measure, size):
        return fitting
    return FittingMeasure(plain, replace(other, remarks=(*other.remarks, BALANCE_LEAVES_LESS)))


def _missed_force(model: MechanicalModel, measure: PredictedForce, size: FloatArray) -> float:
    """Rms error of the force that the unchanged model needs, over all axes, on the samples to fit and to choose by.
    size: (m,): unit of each axis."""
    residuals = measure.residuals(model, ())
    missed = [
        left[record.fit | record.choose] * measure.unit / size
        for left, record in zip(residuals, measure.records, strict=True)
    ]
    return float(np.sqrt(np.mean(np.vstack(missed) ** 2)))
