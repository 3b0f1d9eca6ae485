"""Compare recordings of a faulty device with reference recordings of the same device without the fault.

First, faults that the recordings show directly are sought: sensor faults in the readings, hum in a spectrum, steps of a
quantized command, additional sensor noise. If there are none, `contrast.rank_faults` tests every fault that is not
excluded by the error that it removes from a base model that is fitted to both sets of recordings. Reference recordings
are called clean.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from analysis.diagnosis.contrast.choose_fault import Decision, choose_fault
from analysis.diagnosis.contrast.comparison import Comparison
from analysis.diagnosis.contrast.rank_faults import rank_faults
from analysis.diagnosis.contrast.recording_part import split_into_parts
from analysis.diagnosis.contrast.signal_faults import SignalFault, find_hum, find_quantization, find_sensor_noise
from analysis.diagnosis.errors.choose_measure import MeasureChoice
from analysis.diagnosis.errors.hypothesis import Hypothesis
from analysis.diagnosis.errors.prediction_error import compute_prediction_error
from analysis.diagnosis.reference.model_free_faults import find_sensor_faults
from analysis.diagnosis.search.search import HUM
from analysis.diagnosis.types import TimeBudget
from equalizer.effects.catalogue import CATALOGUE
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.recording import Recording

SENSOR_NOISE, QUANTIZATION = "sensor_noise", "force_quantization"
"""Names of these two effects in the catalogue."""
LARGEST_CLEAN_ERROR = 0.02
"""Largest relative error with which a model counts as predicting a clean recording. Chosen by hand."""
LARGEST_NOISE = 0.1
"""Variation between repeats, relative to the signal's standard deviation, above which it is more than sensor noise, as
of a device with stick-slip. Chosen by hand."""


@dataclass(frozen=True, slots=True, eq=False)
class Contrast:
    """Faults that distinguish the recordings from clean ones. At most one of `sensor_fault`, `signal_fault` and
    `comparison` is not None."""

    sensor_fault: Hypothesis | None
    """A sensor fault that the readings themselves show."""
    signal_fault: SignalFault | None
    """A fault that the spectrum, the steps of a command or the noise shows."""
    comparison: Comparison | None
    """Test of every fault with a base model; None also where the recordings do not allow it."""
    decision: Decision | None
    """The fault that `comparison` names, and its candidates; None without a comparison."""

    def withdraw_name(self, reason: str) -> "Contrast":
        """Return the result in which the fault that `decision` names is a candidate. reason: its `why_not`. Faults that
        the recordings show directly stay named."""
        if self.decision is None or self.decision.named is None:
            return self
        candidates = ((self.decision.named, reason), *self.decision.unnamed)
        return replace(self, decision=Decision(None, (), 0.0, candidates))

    @property
    def is_unexplained(self) -> bool:
        """Whether the comparison finds a significant difference between faulty and clean recordings
        (`Comparison.has_difference`) and no fault is named; False without a comparison."""
        if self.comparison is None or self.decision is None or self.decision.named is not None:
            return False
        return self.comparison.has_difference

    @property
    def named_effects(self) -> frozenset[str]:
        """The named effect, and the effects that cannot be distinguished from it; empty where none is named."""
        if self.sensor_fault is not None:
            return frozenset(claim.effect.name for claim in self.sensor_fault.claims)
        if self.signal_fault is not None:
            return frozenset({self.signal_fault.effect})
        if self.decision is None or self.decision.named is None:
            return frozenset()
        return frozenset({self.decision.named.fault.effect, *self.decision.equivalents})

    def contradicts(self, names: frozenset[str], residual_is_noise: bool) -> bool:
        """Whether this comparison contradicts the result of a search by simulation on the same recordings. names: the
        effects that the search names, with those that it cannot distinguish from them; residual_is_noise: whether its
        residual is noise.

        A named fault contradicts a search that does not name it, unless the residual is noise: a search with a larger
        residual may have replaced one unknown effect by several. Where the sets do not differ significantly, an effect
        that both the search names and the comparison tested only corrects the model.
        """
        if self.named_effects:
            return not (residual_is_noise or names & self.named_effects)
        sets_differ = self.comparison is None or self.comparison.has_difference
        return not sets_differ and bool(names & self.tested_effects)

    @property
    def tested_effects(self) -> frozenset[str]:
        """Effects that the comparison tested; empty without a comparison."""
        return frozenset(
            () if self.comparison is None else (judged_fault.fault.effect for judged_fault in self.comparison.faults)
        )


def find_contrast(
    recordings: Sequence[Recording], clean: Sequence[Recording], excluded: frozenset[str], time_left: TimeBudget
) -> Contrast:
    """Find the difference between recordings and clean ones: the first fault that the recordings show directly, else
    the comparison of all faults by base models. excluded: names of effects that are not considered."""
    effects = [effect for effect in CATALOGUE if effect.name not in excluded]
    sensor_faults = find_sensor_faults(recordings, clean, effects)
    if sensor_faults:
        return Contrast(sensor_faults[0], None, None, None)
    faulty_parts, clean_parts = split_into_parts(recordings), split_into_parts(clean)
    for name, find_fault in ((HUM, find_hum), (QUANTIZATION, find_quantization), (SENSOR_NOISE, find_sensor_noise)):
        signal_fault = (
            find_fault(faulty_parts, clean_parts) if faulty_parts and clean_parts and name not in excluded else None
        )
        if signal_fault is not None:
            return Contrast(None, signal_fault, None, None)
    comparison = rank_faults(recordings, clean, excluded, time_left)
    return Contrast(
        None,
        None,
        comparison,
        None if comparison is None else choose_fault(comparison, recordings[0].response.samples.shape[1]),
    )


def predicts_clean(model: MechanicalModel, clean: Sequence[Recording]) -> bool:
    """Whether the model, without re-tuning, predicts every clean recording with a relative error of at most
    `LARGEST_CLEAN_ERROR`; False where an error cannot be computed."""
    errors = [compute_prediction_error(recording, model, "all").without_gain for recording in clean]
    return all(error is not None and error <= LARGEST_CLEAN_ERROR for error in errors)


def is_noise_from_repeats(measure_choice: MeasureChoice) -> bool:
    """Whether the error measure is a free simulation, and its noise was estimated from repeats in every record and is
    at most `LARGEST_NOISE` times the standard deviation of each channel."""
    signal_std = np.nanstd(np.vstack([record.measured for record in measure_choice.measure.records]), axis=0)
    has_repeats = all(floor.method == "repeats" for floor in measure_choice.floors)
    return (
        has_repeats
        and bool(np.all(measure_choice.measure.noise <= LARGEST_NOISE * signal_std))
        and measure_choice.measure.name == "free simulation"
    )
