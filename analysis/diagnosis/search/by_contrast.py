"""Recordings of a real device beside clean ones of the same: what sets them apart (`contrast`), or shows by itself."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from analysis.diagnosis.contrast.compare import Compared, compared
from analysis.diagnosis.contrast.decide import Decided, decide
from analysis.diagnosis.contrast.lines import Hum, hum_of
from analysis.diagnosis.contrast.taken import taken_of
from analysis.diagnosis.errors.choose_measure import Chosen
from analysis.diagnosis.errors.hypothesis import Hypothesis
from analysis.diagnosis.errors.played_errors import played_error
from analysis.diagnosis.search.seen_directly import seen_directly
from analysis.diagnosis.types import Patience
from equalizer.effects.catalogue import CATALOGUE
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.recording import Recording

HUM = "mains_hum"
FORESEEN = 0.02
"""Share of a clean recording that a model may miss for faults to be told by it alone. By hand, as the next."""
NOISY = 0.1
"""Share of the signal from which what does not repeat is more than noise: a device that slips and sticks."""


AS_ONE = 0.05
"""Excess of the error of both sets together over that of each by itself, up to which they are of one device."""


@dataclass(frozen=True, slots=True, eq=False)
class Contrast:
    """One of the first three, or none."""

    shown: Hypothesis | None
    """By the readings themselves,"""
    hum: Hum | None
    """by a line of their spectrum,"""
    compared: Compared | None
    """or by comparison."""
    decided: Decided | None

    @property
    def left_open(self) -> bool:
        """Whether the sets differ by more than any two stretches of either do, and no fault explains that."""
        if self.compared is None or self.decided is None or self.decided.named is not None:
            return False
        return self.compared.excess > max(AS_ONE, self.compared.usual)

    @property
    def weighed(self) -> frozenset[str]:
        """Effects that were undone."""
        return frozenset(() if self.compared is None else (each.fault.effect for each in self.compared.weighed))


def contrast_of(
    recordings: Sequence[Recording], clean: Sequence[Recording], without: frozenset[str], patient: Patience
) -> Contrast:
    effects = [effect for effect in CATALOGUE if effect.name not in without]
    shown = seen_directly(recordings, clean, effects)
    if shown:
        return Contrast(shown[0], None, None, None)
    hum = None if HUM in without else hum_of(taken_of(recordings), taken_of(clean))
    if hum is not None:
        return Contrast(None, hum, None, None)
    found = compared(recordings, clean, without, patient)
    return Contrast(
        None, None, found, None if found is None else decide(found, recordings[0].response.samples.shape[1])
    )


def foresees(model: MechanicalModel, clean: Sequence[Recording]) -> bool:
    errors = [played_error(recording, model, "all").as_it_is for recording in clean]
    return all(error is not None and error <= FORESEEN for error in errors)


def known_to_repeat(chosen: Chosen) -> bool:
    """Whether a free simulation is compared, and its noise is known from what repeats."""
    size = np.nanstd(np.vstack([record.measured for record in chosen.measure.records]), axis=0)
    repeats = all(floor.how == "repeats" for floor in chosen.floors)
    return repeats and bool(np.all(chosen.measure.noise <= NOISY * size)) and chosen.measure.name == "free simulation"
