"""Which of the structures that a search ranked is taken: the plainest that tells as much, by folds alone."""

from collections.abc import Sequence

from analysis.diagnosis.balance.everything import of_everything
from analysis.diagnosis.balance.regression import Regression
from analysis.diagnosis.balance.structures import Searched, Structure, better

PLAIN = 0.1
"""Share of what the best structure takes of the linear model's error that a plainer one may leave to be preferred."""
MOST_OF_REST, NOTABLE = 0.5, 0.3
"""Shares of what a plain structure leaves above the ceiling, and of all that it leaves, that further laws must take."""


def plainest_structure(searched: Searched) -> Structure:
    """The structure of fewest numbers that leaves hardly more than the best."""
    allowed = searched.best.error + PLAIN * (searched.linear.error - searched.best.error)
    enough = [each for each in searched.ranked if each.error <= allowed]
    plain = min(
        enough, key=lambda each: (numbers_of(searched.regression, each.laws), each.error), default=searched.linear
    )
    ceiling = of_everything(searched.regression, range(searched.regression.columns[0].shape[1]))[0]
    while (richer := _further(searched, plain, ceiling)) is not None:
        plain = richer
    return plain


def _further(searched: Searched, plain: Structure, ceiling: float) -> Structure | None:
    """With laws more that take most of what all laws together could still take."""
    allowed = plain.error - max(MOST_OF_REST * (plain.error - ceiling), NOTABLE * plain.error)
    more = [
        each
        for each in searched.ranked
        if set(plain.laws) < set(each.laws) and each.error <= allowed and better(plain, each)
    ]
    return min(more, key=lambda each: (numbers_of(searched.regression, each.laws), each.error), default=None)


def numbers_of(regression: Regression, laws: Sequence[int]) -> int:
    """How many laws have. The width within which a dry friction turns round counts for none; a weight on a lever takes
    the place of the spring, whose number is then none."""
    count = 0
    for number in laws:
        law, place = regression.laws[number], regression.places[number]
        count += place.stop - place.start + (0 if law.effect == "coulomb_friction" else len(law.numbers))
        count -= law.effect == "gravity_torque"
    return count
