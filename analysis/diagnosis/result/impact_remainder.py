"""Where play does not explain how strong the response is. Its course does not count: no simulation predicts blows."""

import numpy as np

from analysis.diagnosis.document import Mismatch
from analysis.diagnosis.errors.error_measure import ErrorMeasure
from analysis.diagnosis.search.explain import Explanation
from analysis.diagnosis.search.verdict import BY_CHANCE


def impact_remainder(measure: ErrorMeasure, found: Explanation) -> tuple[Mismatch, ...]:
    """One row for each channel that is further off than chance takes it; the share is the rms logarithm of the ratio of
    amplitudes."""
    if found.statistic is None:
        return ()
    record, standing = measure.records[0].recording, found.after.standing
    names = (*record.response.channels, *(() if record.position is None else record.position.channels))
    worst = np.maximum(standing.fit, standing.choose)
    return tuple(
        Mismatch(
            names[c], "+".join(record.command.channels), (0.0, record.sample_rate_hz / 2), None, None,
            min(float(worst[c] * found.statistic.chance[c]), 1.0), 0.0,
        )
        for c in np.argsort(-worst).tolist()
        if worst[c] > BY_CHANCE
    )  # fmt: skip
