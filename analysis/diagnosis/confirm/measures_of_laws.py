"""The error measures in which the laws that force balances name are fitted, the strictest first."""

from collections.abc import Iterator, Sequence

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
