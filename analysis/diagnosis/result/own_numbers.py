"""The simple model's own numbers after a diagnosis, with their intervals, where it is one body."""

from collections.abc import Mapping

import numpy as np

from analysis.diagnosis.errors.choose_measure import measure_of
from analysis.diagnosis.errors.intervals import standard_errors
from analysis.diagnosis.errors.output_error import evaluated
from analysis.diagnosis.errors.tuning import Tuning, tuning_of
from analysis.diagnosis.result.findings import Findings
from analysis.diagnosis.result.real_answer import OwnNumber
from analysis.diagnosis.search.rivalry import Arena, sensitivity_at
from analysis.diagnosis.types import Mapper
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray

_REACH = 1.96


def own_numbers(
    found: Findings, recording: Recording, nominal: Mapping[str, float], map_: Mapper
) -> tuple[OwnNumber, ...]:
    """Mass, damping and stiffness of one body; none where there are more. nominal: by these words, SI.

    The intervals are at the end of the search, on the samples that were fitted to. Where what is left is no noise, they
    are widened by how many times the noise it is: a law that is a little wrong shifts what stands beside it.
    """
    model = found.given
    if model.coordinates != 1 or found.explanation.statistic is not None:
        return ()
    whole = measure_of((recording,), model).measure
    tuning = tuning_of(model, recording.command.channels)
    arena = Arena(whole.shortened(), whole, tuning, map_)
    after = found.explanation.after
    there = evaluated(arena.measure, tuning, after.fitted.deviations, after.fitted.hypothesis)
    known = sensitivity_at(arena, there.deviations, there.hypothesis, with_forces=True)
    wide = max(after.standing.seen, 1.0)
    errors = standard_errors(arena.measure, tuning, there, known)[: len(tuning.names)] * tuning.deviation * wide
    return _numbers(tuning, model, tuning.values(there.deviations), errors, nominal)


def _numbers(
    tuning: Tuning, model: MechanicalModel, changes: FloatArray, errors: FloatArray, nominal: Mapping[str, float]
) -> tuple[OwnNumber, ...]:
    given = (model.mass[0, 0], model.damping[0, 0], model.stiffness[0, 0])
    words = ("mass", "damping", "stiffness")
    rows = zip(words, given, tuning.units, changes, errors, strict=False)
    return tuple(_number(name, unit, float(start + by), float(error), nominal) for name, start, unit, by, error in rows)


def _number(name: str, unit: str, value: float, error: float, nominal: Mapping[str, float]) -> OwnNumber:
    reach = _REACH * error
    sure = bool(np.isfinite(reach))
    return OwnNumber(
        name, unit, value, value - reach if sure else None, value + reach if sure else None, nominal.get(name)
    )
