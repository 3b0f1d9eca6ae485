"""Whether the data separate two explanations."""

from analysis.diagnosis.search.rivalry import Contender
from analysis.diagnosis.settings import AS_GOOD_GAIN, AS_GOOD_SHARE, NOISE_KNOWN_TO


def excess(contender: Contender) -> float:
    """Mean log error power above the noise."""
    return max(contender.standing.chosen_by - NOISE_KNOWN_TO, 0.0)


def inseparable(best: Contender, other: Contender) -> bool:
    """Also where the difference is smaller than what both gain on clean recordings, where neither effect is present."""
    worse = other.standing.chosen_by - best.standing.chosen_by
    return worse <= max(AS_GOOD_GAIN, AS_GOOD_SHARE * excess(best), min(other.usual, best.usual))
