"""Whether held-out samples hold any motion: an error on a stretch where the device stands still says nothing."""

from collections.abc import Sequence

import numpy as np

from analysis.diagnosis.data.observed import Observed
from analysis.diagnosis.settings import STILL_SHARE
from analysis.diagnosis.types import Mask
from equalizer.plant.mechanical_model import DERIVATIVE_OF_QUANTITY
from equalizer.signals.signal import FloatArray


def held_out_stands_still(records: Sequence[Observed]) -> bool:
    """Whether something is held out, and no channel moves in it as it does in what is fitted."""
    if not any(each.test.any() for each in records):
        return False
    held = _mean_power(records, [each.test for each in records])
    known = _mean_power(records, [each.fit | each.choose for each in records])
    return bool((known > 0).any() and (held <= STILL_SHARE * known).all())


def _mean_power(records: Sequence[Observed], masks: Sequence[Mask]) -> FloatArray:
    """(c,): mean square of each channel about rest over the masked samples."""
    moved = [_about_rest(each, mask)[mask] for each, mask in zip(records, masks, strict=True)]
    return np.asarray(np.nanmean(np.concatenate(moved) ** 2, axis=0))


def _about_rest(record: Observed, mask: Mask) -> FloatArray:
    """(n, c): speeds as they are, for rest is zero; all else about its mean over the masked samples."""
    signals = (record.recording.response, record.recording.position)
    quantities = [word for signal in signals if signal is not None for word in signal.quantities]
    speeds = [DERIVATIVE_OF_QUANTITY.get(word) == 1 for word in quantities[: record.measured.shape[1]]]
    if not mask.any():
        return record.measured
    return np.asarray(record.measured - np.where(speeds, 0.0, np.nanmean(record.measured[mask], axis=0)))
