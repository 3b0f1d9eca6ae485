"""Tells whether the data separate two explanations."""

import numpy as np

from analysis.diagnosis.search.search_context import FittedCandidate
from analysis.diagnosis.settings import (
    ADDED_GAIN,
    ADDED_SHARE,
    AS_GOOD_GAIN,
    AS_GOOD_SHARE,
    NOISE_ALONE,
    NOISE_KNOWN_TO,
)


def excess(candidate: FittedCandidate) -> float:
    """Mean log error power above the noise."""
    return max(candidate.score.mean_log_error - NOISE_KNOWN_TO, 0.0)


def inseparable(best: FittedCandidate, other: FittedCandidate) -> bool:
    """Whether two candidates' errors do not differ enough; also where the difference is smaller than what both gain on
    clean recordings, where neither effect is present."""
    worse = other.score.mean_log_error - best.score.mean_log_error
    return worse <= max(AS_GOOD_GAIN, AS_GOOD_SHARE * excess(best), min(other.usual, best.usual))


def is_worthwhile(base: FittedCandidate, better: FittedCandidate) -> bool:
    """Whether an effect lowers the error enough to be added. Where only the worst channel is above the noise, and not
    the mean over channels, its logarithm must fall by half."""
    gained, over = base.score.mean_log_error - better.score.mean_log_error, np.log(base.score.worst_channel)
    if excess(base) == 0 and over > np.log(NOISE_ALONE) and np.log(better.score.worst_channel) > over / 2:
        return False
    return gained > max(ADDED_SHARE * excess(base), ADDED_GAIN)
