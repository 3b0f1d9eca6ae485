"""Whether the data can tell two explanations apart."""

from analysis.diagnosis.search.rivalry import Contender

NOISE_ITSELF = 0.01
"""Mean log error power that the best of models may leave: a noise is not known better."""
CLOSE = 0.0015
"""Difference of mean log error power below which explanations are as good as each other: a hundred times what chance
brings in a minute of six channels, for no simulation is exact to more;"""
CLOSE_SHARE = 0.1
"""or as a share of what the better one still leaves above the noise."""


def excess(contender: Contender) -> float:
    """Mean log error power above the noise."""
    return max(contender.standing.chosen_by - NOISE_ITSELF, 0.0)


def inseparable(best: Contender, other: Contender) -> bool:
    """As much as both gain on a device in order, where neither is true, they mend the model itself: less than that
    tells nothing."""
    worse = other.standing.chosen_by - best.standing.chosen_by
    return worse <= max(CLOSE, CLOSE_SHARE * excess(best), min(other.usual, best.usual))
