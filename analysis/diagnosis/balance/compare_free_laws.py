"""Compare laws outside the catalogue (`free_laws`) with the sum of laws that a force balance chose.

A law outside the catalogue is tried alone, in place of each law of the chosen sum, and in addition to it. Its nonlinear
parameters are refined in the most promising sums. If the best of them is significantly better than the chosen sum, and
leaves at most 1 - `FREE_LAW_GAIN` of its cross-validated squared error (of the linear balance's where no law of the sum
can be named), the sum with the fewest parameters at about the same error replaces it. It is then judged on held-out
data like any other, with the catalogue's laws as rivals. Called by `balances`.
"""

from dataclasses import replace

import numpy as np

from analysis.diagnosis.balance.free_laws import FREE_LAWS, make_free_laws
from analysis.diagnosis.balance.judge_laws import Balance, judge_structure
from analysis.diagnosis.balance.law import measure_scales
from analysis.diagnosis.balance.linear_part import is_freely_turning
from analysis.diagnosis.balance.regression import Regression, append_laws, fit_all_laws
from analysis.diagnosis.balance.structures import (
    Structure,
    add_further_laws,
    count_parameters,
    fit_values,
    improves_significantly,
    refine_parameters,
)
from analysis.diagnosis.settings import FREE_LAW_GAIN, MOST_SUMMED_LAWS, PLAINER_LEAVES

MOST_COMPARED_SUMS = 12
"""Number of sums whose nonlinear parameters are refined. Chosen: there are eleven free laws."""


def compare_with_free_laws(balance: Balance, excluded: frozenset[str]) -> Balance:
    """The balance with laws outside the catalogue, where these leave clearly less error; else the same balance, also
    where it has a law of the command or a given model. excluded: names of effects that are left out."""
    regression = balance.search.regression
    has_law_of_command = any(not law.has_column for law in balance.laws)
    if excluded >= FREE_LAWS or not balance.tested or has_law_of_command or regression.prior is not None:
        return balance
    channel = regression.base_terms.driven_channel
    scales = replace(measure_scales(regression.motions, channel, False), turns=is_freely_turning(regression))
    tried_laws = [law for law in make_free_laws(channel, scales) if law.effect not in excluded]
    if not tried_laws:
        return balance
    try:
        extended, sums = _list_sums(append_laws(regression, tried_laws), balance.chosen)
    except np.linalg.LinAlgError:
        return balance
    # A catalogue sum of which nothing can be named is no explanation: the linear balance is then the reference.
    reference_error = (balance.chosen if balance.named else balance.search.linear).error
    best = min(sums, key=lambda s: s.error, default=balance.chosen)
    if best.error > (1 - FREE_LAW_GAIN) * reference_error or not improves_significantly(balance.chosen, best):
        return balance
    improved = [s for s in sums if s.error <= best.error + PLAINER_LEAVES * (balance.chosen.error - best.error)]
    simplest = min(improved, key=lambda s: (count_parameters(extended, s.laws), s.error))
    search = replace(balance.search, regression=extended, best=best, ranked=(*balance.search.ranked, *sums))
    least_error = fit_all_laws(extended, range(extended.columns[0].shape[1]))[0]
    while (larger := add_further_laws(search, simplest, least_error)) is not None:
        simplest = larger
    judged = judge_structure(search, simplest)
    free_laws = [law for law in judged.laws if law.is_free and law.gain_low > 0 and law.gain >= FREE_LAW_GAIN]
    # Without a name, too, a law is a candidate only where it halves the error on the held-out samples.
    halves_error = judged.error <= np.sqrt(1 - FREE_LAW_GAIN) * balance.linear and not balance.named
    return judged if free_laws and (halves_error or any(law.named for law in free_laws)) else balance


def _list_sums(regression: Regression, chosen: Structure) -> tuple[Regression, list[Structure]]:
    """The regression with refined free laws, and the most promising sums of laws that contain one of them."""
    laws_of_sums = {
        tuple(sorted({*kept, number}))
        for number, law in enumerate(regression.laws)
        if law.effect in FREE_LAWS
        for kept in ((), chosen.laws, *(_drop(chosen.laws, place) for place in range(len(chosen.laws))))
        if len(kept) < MOST_SUMMED_LAWS
    }
    best_by_effects: dict[tuple[str, ...], Structure] = {}
    for laws in laws_of_sums:
        evaluated = _evaluate(regression, laws)
        effects = tuple(sorted(regression.laws[number].effect for number in laws))
        if effects not in best_by_effects or evaluated.error < best_by_effects[effects].error:
            best_by_effects[effects] = evaluated
    sums = sorted(best_by_effects.values(), key=lambda s: s.error)[:MOST_COMPARED_SUMS]
    promising = [s for s in sums if None not in fit_values(regression, s.laws)]
    refined = refine_parameters(regression, promising)
    return refined, [_evaluate(refined, structure.laws) for structure in promising]


def _drop(laws: tuple[int, ...], place: int) -> tuple[int, ...]:
    return (*laws[:place], *laws[place + 1 :])


def _evaluate(regression: Regression, laws: tuple[int, ...]) -> Structure:
    return Structure(laws, regression.cross_validate(regression.select_columns(laws)))
