"""Tells whether the data separate two explanations."""

from analysis.diagnosis.search.search_context import FittedCandidate
from analysis.diagnosis.settings import AS_GOOD_GAIN, AS_GOOD_SHARE, NOISE_KNOWN_TO


def excess(candidate: FittedCandidate) -> float:
    """Mean log error power above the noise."""
    return max(candidate.score.mean_log_error - NOISE_KNOWN_TO, 0.0)


def inseparable(best: FittedCandidate, other: FittedCandidate) -> bool:
    """Whether two candidates' errors do not differ enough; also where the difference is smaller than what both gain on
    clean recordings, where neither effect is present."""
    worse = other.score.mean_log_error - best.score.mean_log_error
    return worse <= max(AS_GOOD_GAIN, AS_GOOD_SHARE * excess(best), min(other.usual, best.usual))
