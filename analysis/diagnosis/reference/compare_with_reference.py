"""Recordings of a real device beside clean ones of the same: what sets them apart (`contrast`), or shows by itself."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from analysis.diagnosis.contrast.compare import Compared, compared
from analysis.diagnosis.contrast.decide import Decided, decide
from analysis.diagnosis.contrast.lines import Line, hum_of, noise_of, steps_of
from analysis.diagnosis.contrast.taken import taken_of
from analysis.diagnosis.errors.choose_measure import Chosen
from analysis.diagnosis.errors.hypothesis import Hypothesis
from analysis.diagnosis.errors.played_errors import played_error
from analysis.diagnosis.reference.model_free_faults import seen_directly
from analysis.diagnosis.search.explain import Explanation
from analysis.diagnosis.types import TimeBudget
from equalizer.effects.catalogue import CATALOGUE
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.recording import Recording

HUM, NOISE, STEPS = "mains_hum", "sensor_noise", "force_quantization"
LOWEST_MAINS_HZ = 45.0
FORESEEN = 0.02
"""Share of a clean recording that a model may miss for faults to be told by it alone. By hand, as the next."""
NOISY = 0.1
"""Share of the signal from which what does not repeat is more than noise: a device that slips and sticks."""


@dataclass(frozen=True, slots=True, eq=False)
class Contrast:
    """One of the first three, or none."""

    shown: Hypothesis | None
    """By the readings themselves,"""
    line: Line | None
    """by their spectrum, or by steps of the command,"""
    compared: Compared | None
    """or by comparison."""
    decided: Decided | None

    @property
    def left_open(self) -> bool:
        """Whether the sets differ by more than any two stretches of either do, and no fault explains that."""
        if self.compared is None or self.decided is None or self.decided.named is not None:
            return False
        return self.compared.differ

    @property
    def weighed(self) -> frozenset[str]:
        """Effects that were undone."""
        return frozenset(() if self.compared is None else (each.fault.effect for each in self.compared.weighed))


def contrast_of(
    recordings: Sequence[Recording], clean: Sequence[Recording], without: frozenset[str], time_left: TimeBudget
) -> Contrast:
    effects = [effect for effect in CATALOGUE if effect.name not in without]
    shown = seen_directly(recordings, clean, effects)
    if shown:
        return Contrast(shown[0], None, None, None)
    faulty, references = taken_of(recordings), taken_of(clean)
    for name, look in ((HUM, hum_of), (STEPS, steps_of), (NOISE, noise_of)):
        line = look(faulty, references) if faulty and references and name not in without else None
        if line is not None:
            return Contrast(None, line, None, None)
    found = compared(recordings, clean, without, time_left)
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


def hums_low(found: Explanation) -> bool:
    """A line far below any mains is a harmonic of what drives the device."""
    placed = found.after.fitted.hypothesis.placed()
    return any(each.effect.name == HUM and each.values["frequency"] < LOWEST_MAINS_HZ for each in placed)
