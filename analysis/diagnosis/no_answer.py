"""An explanation that foresees nothing: effects that hold the device still are the last refuge of a fit."""

import numpy as np

from analysis.diagnosis.error_measure import ErrorMeasure
from analysis.diagnosis.rivalry import Contender
from analysis.diagnosis.standing import rms_over

NO_BETTER = 0.9
"""Share of its signal that an explanation may leave in every channel: also where noise is no less, for then nothing
can be told by name."""


def foresees_nothing(measure: ErrorMeasure, contender: Contender) -> bool:
    """On the samples that decisions may see: in no channel is it better than no prediction."""
    masks = [record.fit | record.choose for record in measure.records]
    signals = tuple(record.measured - np.nanmean(record.measured, axis=0) for record in measure.records)
    size = rms_over(measure.records, signals, masks)
    left = rms_over(measure.records, contender.fitted.residuals, masks) * measure.unit
    return bool((left >= NO_BETTER * size).all())
