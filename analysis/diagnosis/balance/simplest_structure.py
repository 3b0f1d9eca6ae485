"""Model selection among the ranked structures by cross-validation: the fewest parameters at about the least error."""

from collections.abc import Sequence

from analysis.diagnosis.balance.regression import Regression, fit_all_laws
from analysis.diagnosis.balance.structures import Structure, StructureSearch, is_better
from analysis.diagnosis.settings import FURTHER_LAW_OF_ALL, FURTHER_LAW_OF_REST, PLAINER_LEAVES

WIDTH_ALONE = ("coulomb_friction", "condition_dependent_friction")
"""Laws whose only nonlinear number is the width of a smoothed sign."""


def simplest_structure(search: StructureSearch) -> Structure:
    """The structure with the fewest parameters whose cross-validated error is close to the smallest."""
    allowed = search.best.error + PLAINER_LEAVES * (search.linear.error - search.best.error)
    enough = [each for each in search.ranked if each.error <= allowed]
    plain = min(enough, key=lambda each: (numbers_of(search.regression, each.laws), each.error), default=search.linear)
    ceiling = fit_all_laws(search.regression, range(search.regression.columns[0].shape[1]))[0]
    while (richer := _further(search, plain, ceiling)) is not None:
        plain = richer
    return plain


def _further(search: StructureSearch, plain: Structure, ceiling: float) -> Structure | None:
    """The structure with further laws that explain most of what all laws together could still explain; None = none
    such."""
    allowed = plain.error - max(FURTHER_LAW_OF_REST * (plain.error - ceiling), FURTHER_LAW_OF_ALL * plain.error)
    more = [
        each
        for each in search.ranked
        if _extends(search.regression, plain.laws, each.laws) and each.error <= allowed and is_better(plain, each)
    ]
    return min(more, key=lambda each: (numbers_of(search.regression, each.laws), each.error), default=None)


def _extends(regression: Regression, plain: Sequence[int], richer: Sequence[int]) -> bool:
    """Whether these laws are the given ones and more; dry friction may be replaced by one that depends on a
    condition."""
    covered, known = set(richer), {regression.laws[number].key for number in richer}
    for number in plain:
        effect, channel = regression.laws[number].key
        if effect == "coulomb_friction" and ("condition_dependent_friction", channel) in known:
            covered.add(number)
    return set(plain) < covered


def numbers_of(regression: Regression, laws: Sequence[int]) -> int:
    """Number of parameters of these laws. The width of a friction's smoothed sign is not counted, and gravity torque
    counts for one less, because it replaces the spring."""
    count = 0
    for number in laws:
        law, place = regression.laws[number], regression.places[number]
        count += place.stop - place.start + (0 if law.effect in WIDTH_ALONE else len(law.numbers))
        count -= law.effect == "gravity_torque"
    return count
