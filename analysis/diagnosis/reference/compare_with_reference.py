"""Comparison of recordings of a real device with clean ones of the same device: faults by `contrast`, and faults that
the recordings show directly."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from analysis.diagnosis.contrast.compare import compare
from analysis.diagnosis.contrast.comparison import Comparison
from analysis.diagnosis.contrast.decide import Decision, decide
from analysis.diagnosis.contrast.part import split_into_parts
from analysis.diagnosis.contrast.signal_faults import SignalFault, find_hum, find_quantization, find_sensor_noise
from analysis.diagnosis.errors.choose_measure import MeasureChoice
from analysis.diagnosis.errors.hypothesis import Hypothesis
from analysis.diagnosis.errors.prediction_error import prediction_error
from analysis.diagnosis.reference.model_free_faults import find_sensor_faults
from analysis.diagnosis.search.search import HUM
from analysis.diagnosis.types import TimeBudget
from equalizer.effects.catalogue import CATALOGUE
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.recording import Recording

NOISE, STEPS = "sensor_noise", "force_quantization"
LARGEST_CLEAN_ERROR = 0.02
"""Prediction error of a model on a clean recording, as a share, up to which it is used alone to find faults. By hand,
as the next."""
NOISY = 0.1
"""Share of the signal above which the variation between repeats is more than noise: a device with stick-slip."""


@dataclass(frozen=True, slots=True, eq=False)
class Contrast:
    """Faults that distinguish the recordings from clean ones; at most one of the first three."""

    shown: Hypothesis | None
    """A sensor fault that the readings themselves show."""
    line: SignalFault | None
    """A fault that a spectrum or the steps of a command show."""
    comparison: Comparison | None
    """The comparison of all faults by a base model."""
    decision: Decision | None

    def without_name(self, why_not: str) -> "Contrast":
        """The result with its named fault made a candidate; faults that readings, spectra or steps show stay named."""
        if self.decision is None or self.decision.named is None:
            return self
        left = ((self.decision.named, why_not), *self.decision.others)
        return replace(self, decision=Decision(None, (), 0.0, left))

    @property
    def left_open(self) -> bool:
        """Whether the sets differ by more than any two stretches of either do, and no fault explains that."""
        if self.comparison is None or self.decision is None or self.decision.named is not None:
            return False
        return self.comparison.differ

    @property
    def named_effects(self) -> frozenset[str]:
        """The named effect, and those that cannot be distinguished from it."""
        if self.shown is not None:
            return frozenset(claim.effect.name for claim in self.shown.claims)
        if self.line is not None:
            return frozenset({self.line.effect})
        if self.decision is None or self.decision.named is None:
            return frozenset()
        return frozenset({self.decision.named.fault.effect, *self.decision.alike})

    def contradicts(self, names: frozenset[str], explained: bool) -> bool:
        """Whether it contradicts the result of a search by simulation on the same recordings. names: the effects that
        the search names, with their classes; explained: whether their residual is noise.

        A search with a larger residual may have replaced one unknown effect by several; and where the sets do not
        differ significantly, an effect that the comparison tested only corrects the model.
        """
        if self.named_effects:
            return not (explained or names & self.named_effects)
        differ = self.comparison is None or self.comparison.differ
        return not differ and bool(names & self.tested_effects)

    @property
    def tested_effects(self) -> frozenset[str]:
        """Effects that the comparison tested."""
        return frozenset(() if self.comparison is None else (each.fault.effect for each in self.comparison.faults))


def contrast_of(
    recordings: Sequence[Recording], clean: Sequence[Recording], without: frozenset[str], time_left: TimeBudget
) -> Contrast:
    """The difference between recordings and clean ones: first a fault that readings, a spectrum or steps show directly,
    else the comparison of all faults by base models. without: effects that are not considered."""
    effects = [effect for effect in CATALOGUE if effect.name not in without]
    shown = find_sensor_faults(recordings, clean, effects)
    if shown:
        return Contrast(shown[0], None, None, None)
    faulty, references = split_into_parts(recordings), split_into_parts(clean)
    for name, look in ((HUM, find_hum), (STEPS, find_quantization), (NOISE, find_sensor_noise)):
        line = look(faulty, references) if faulty and references and name not in without else None
        if line is not None:
            return Contrast(None, line, None, None)
    found = compare(recordings, clean, without, time_left)
    return Contrast(
        None, None, found, None if found is None else decide(found, recordings[0].response.samples.shape[1])
    )


def predicts_clean(model: MechanicalModel, clean: Sequence[Recording]) -> bool:
    """Whether the model as it is predicts every clean recording with an error of at most `LARGEST_CLEAN_ERROR`."""
    errors = [prediction_error(recording, model, "all").without_gain for recording in clean]
    return all(error is not None and error <= LARGEST_CLEAN_ERROR for error in errors)


def noise_is_from_repeats(chosen: MeasureChoice) -> bool:
    """Whether a free simulation is compared, and its noise is known from what repeats."""
    size = np.nanstd(np.vstack([record.measured for record in chosen.measure.records]), axis=0)
    repeats = all(floor.how == "repeats" for floor in chosen.floors)
    return repeats and bool(np.all(chosen.measure.noise <= NOISY * size)) and chosen.measure.name == "free simulation"
