"""Whether the data can tell two explanations apart."""

from analysis.diagnosis.rivalry import Contender

CLOSE = 0.03
"""Difference of mean log error power below which explanations are as good as each other,"""
CLOSE_SHARE = 0.1
"""or as a share of what the better one still leaves."""


def inseparable(best: Contender, other: Contender) -> bool:
    worse = other.standing.chosen_by - best.standing.chosen_by
    return worse <= max(CLOSE, CLOSE_SHARE * best.standing.chosen_by)
