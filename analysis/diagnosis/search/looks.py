"""How errors are measured of what a force balance named: in which measures its laws are fitted, one after the other."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from analysis.diagnosis.balance.first_model import first_model, share_within
from analysis.diagnosis.balance.reduced_recordings import is_reduced, reduced_recordings
from analysis.diagnosis.balance.weigh import Balance
from analysis.diagnosis.errors.choose_measure import Chosen, Compared, measure_by_force, measure_of
from analysis.diagnosis.errors.predicted_force import PredictedForce
from analysis.diagnosis.settings import LAWS_WITHIN
from equalizer.plant.mechanical_model import MechanicalModel, MechanicalModelError
from equalizer.signals.recording import Recording


@dataclass(frozen=True, slots=True, eq=False)
class Look:
    """A model, and how its errors are measured."""

    model: MechanicalModel
    chosen: Chosen
    narrow: bool = False
    """Only up to where noise is small in the force, which may leave numbers of laws open."""


def looks_of(
    recordings: Sequence[Recording], model: MechanicalModel, balances: Sequence[Balance], compared: Compared
) -> Iterator[Look]:
    """In a free simulation, the strictest, where the fitted model bears one; else along the measured motion, with the
    balance's own linear numbers: up to where noise is small, where that holds what the laws push, or else as far as the
    balance looked."""
    if not any(balance.named for balance in balances):
        return
    chosen = measure_of(recordings, model)
    if chosen.measure.name == "free simulation" and compared != "force":
        yield Look(model, chosen)
    if compared == "motion":
        return
    try:
        reduced = reduced_recordings(recordings, balances) if is_reduced(balances) else recordings
        rigid = first_model(balances, reduced[0], model.name)
        if rigid is not None:
            narrow = measure_by_force(reduced, rigid, None)
            held = share_within(balances, narrow.measure.band_hz) if isinstance(narrow.measure, PredictedForce) else 0.0
            if held >= LAWS_WITHIN:
                yield Look(rigid, narrow, narrow=True)
            yield Look(rigid, measure_by_force(reduced, rigid, balances[0].searched.regression.motions[0].band_hz))
    except (MechanicalModelError, np.linalg.LinAlgError):
        return
