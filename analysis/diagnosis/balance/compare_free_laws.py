"""Compare laws outside the catalogue (`free_laws`) with the sum of laws that a force balance chose.

A law outside the catalogue is tried alone, in place of each law of the chosen sum, and in addition to it (at most
`MOST_SUMMED_LAWS` laws). Its nonlinear parameters are refined in the most promising sums. If the best of them is
significantly better than the chosen sum, and leaves at most 1 - `FREE_LAW_GAIN` of its cross-validated squared error
(of the linear balance's where no law of the sum can be named), the sum with the fewest parameters at about the same
error is completed by further laws (`add_further_laws`) and judged on held-out data, with the catalogue's laws as
rivals. It replaces the chosen sum where a free law with a gain of at least `FREE_LAW_GAIN` is named, or where there is
such a law, the chosen sum has no named law, and the rms error is at most half of the linear balance's. Else the chosen
sum may lose its names (`withdraw_names_of_surpassed_sum`).
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from analysis.diagnosis.balance.change_laws import append_laws
from analysis.diagnosis.balance.judge_laws import Balance, judge_structure
from analysis.diagnosis.balance.judged_law import find_family
from analysis.diagnosis.balance.laws.free_laws import (
    FREE_LAWS,
    FREE_POSITION_LAWS,
    FREE_SPEED_LAWS,
    make_free_laws,
)
from analysis.diagnosis.balance.laws.law import Law, measure_scales
from analysis.diagnosis.balance.linear_part import is_freely_turning
from analysis.diagnosis.balance.regression import Regression, fit_all_laws
from analysis.diagnosis.balance.structures import (
    Structure,
    add_further_laws,
    count_parameters,
    fit_values,
    improves_significantly,
    refine_parameters,
)
from analysis.diagnosis.limits import FREE_LAW_GAIN, MOST_SUMMED_LAWS, SIMPLER_SHORTFALL

MOST_COMPARED_SUMS = 12
"""Number of sums whose nonlinear parameters are refined. Chosen: there are eleven free laws."""
SURPASSED_REASON = "a single law that the catalogue lacks explains more than this one, or the sum of laws with it"
"""Reason, in a message, not to name the laws of a sum."""
LAWS_BY_ARGUMENT = (
    find_family("coulomb_friction") | FREE_SPEED_LAWS,
    find_family("hardening_stiffness") | FREE_POSITION_LAWS,
)
"""Laws of the speed alone or nearly so, and of the position: in the catalogue and outside."""
CONTACTS = {"end_stop", "contact_beyond_position"}
"""Laws of a contact that closes at a position, in the catalogue and outside."""


def compare_with_free_laws(balance: Balance, excluded: frozenset[str]) -> Balance:
    """Compare a balance with sums that contain a law outside the catalogue, and return the better of the two. The
    balance is returned unchanged where it has a law of the command, has a given model as its base, or was not tested on
    held-out data. excluded: names of effects that are left out."""
    regression = balance.search.regression
    has_law_of_command = any(not law.has_column for law in balance.laws)
    if excluded >= FREE_LAWS or not balance.tested or has_law_of_command or regression.prior is not None:
        return balance
    channel = regression.base_terms.driven_channel
    scales = replace(measure_scales(regression.motions, channel, False), turns_freely=is_freely_turning(regression))
    tried_laws = [law for law in make_free_laws(channel, scales) if law.effect not in excluded]
    if not tried_laws:
        return balance
    try:
        extended_regression, sums = _list_sums(append_laws(regression, tried_laws), balance.chosen)
    except np.linalg.LinAlgError:
        return balance
    # A catalogue sum of which nothing can be named is no explanation: the linear balance is then the reference.
    reference_error = (balance.chosen if balance.named else balance.search.linear).error
    best_sum = min(sums, key=lambda s: s.error, default=balance.chosen)
    kept_balance = withdraw_names_of_surpassed_sum(balance, extended_regression, sums)
    if best_sum.error > (1 - FREE_LAW_GAIN) * reference_error or not improves_significantly(balance.chosen, best_sum):
        return kept_balance
    good_sums = [
        s for s in sums if s.error <= best_sum.error + SIMPLER_SHORTFALL * (balance.chosen.error - best_sum.error)
    ]
    simplest = min(good_sums, key=lambda s: (count_parameters(extended_regression, s.laws), s.error))
    search = replace(
        balance.search, regression=extended_regression, best=best_sum, ranked=(*balance.search.ranked, *sums)
    )
    least_error = fit_all_laws(extended_regression, range(extended_regression.columns[0].shape[1]))[0]
    while (extended_sum := add_further_laws(search, simplest, least_error)) is not None:
        simplest = extended_sum
    judged_balance = judge_structure(search, simplest)
    free_laws = [law for law in judged_balance.laws if law.is_free and law.gain_low > 0 and law.gain >= FREE_LAW_GAIN]
    # A law that is not named is a candidate only where its sum halves the linear balance's error on the test blocks.
    halves_error = judged_balance.error <= np.sqrt(1 - FREE_LAW_GAIN) * balance.linear_error and not balance.named
    return judged_balance if free_laws and (halves_error or any(law.named for law in free_laws)) else kept_balance


def withdraw_names_of_surpassed_sum(balance: Balance, regression: Regression, sums: Sequence[Structure]) -> Balance:
    """Withdraw the names of laws of several families where a single free law leaves significantly less error than their
    sum, which then only approximates it; and the names of laws of one family where a free law of other arguments (such
    as a product, in place of a damping) does so. sums: laws (indices in the regression), with one free law each."""
    effects = {law.law.effect for law in balance.laws if not law.law.is_linear}
    if len({frozenset(find_family(effect)) for effect in effects}) > 1:
        rivals = [s for s in sums if len(s.laws) == 1]
    else:
        like_laws = next((laws for laws in LAWS_BY_ARGUMENT if effects <= laws), effects)
        laws_of_sums = [(s, _list_nonlinear_laws(regression, s)) for s in sums]
        rivals = [s for s, laws in laws_of_sums if len(laws) == 1 and laws[0].effect not in like_laws]
    is_surpassed = any(improves_significantly(balance.chosen, rival) for rival in rivals)
    return balance.withdraw_names(SURPASSED_REASON) if is_surpassed else balance


def _list_nonlinear_laws(regression: Regression, structure: Structure) -> list[Law]:
    """List the laws of a structure other than linear ones."""
    return [regression.laws[index] for index in structure.laws if not regression.laws[index].is_linear]


def _list_sums(regression: Regression, chosen: Structure) -> tuple[Regression, list[Structure]]:
    """List the most promising sums of laws that contain a free law, with the regression in which these laws are
    refined. chosen: the sum of the balance."""
    laws_of_sums = {
        tuple(sorted({*kept_laws, law_index}))
        for law_index, law in enumerate(regression.laws)
        if law.effect in FREE_LAWS
        for kept_laws in ((), chosen.laws, *(_omit_law(chosen.laws, omitted) for omitted in range(len(chosen.laws))))
        if len(kept_laws) < MOST_SUMMED_LAWS and not any(_close_together(regression, law_index, k) for k in kept_laws)
    }
    best_by_effects: dict[tuple[str, ...], Structure] = {}
    for laws in laws_of_sums:
        evaluated = _cross_validate_sum(regression, laws)
        effects = tuple(sorted(regression.laws[law_index].effect for law_index in laws))
        if effects not in best_by_effects or evaluated.error < best_by_effects[effects].error:
            best_by_effects[effects] = evaluated
    sums = sorted(best_by_effects.values(), key=lambda s: s.error)[:MOST_COMPARED_SUMS]
    promising = [s for s in sums if None not in fit_values(regression, s.laws)]
    refined = refine_parameters(regression, promising)
    return refined, [_cross_validate_sum(refined, structure.laws) for structure in promising]


def _close_together(regression: Regression, first_index: int, second_index: int) -> bool:
    """Whether two laws (indices) are contacts along one channel that are closed at the same samples: the second would
    only correct the place of the first, whose refinement takes finite steps, and share its stiffness."""
    first, second = regression.laws[first_index], regression.laws[second_index]
    if not {first.effect, second.effect} <= CONTACTS or first.channel != second.channel:
        return False
    return any(
        bool(np.any(first.make_columns(motion, first.numbers) * second.make_columns(motion, second.numbers)))
        for motion in regression.motions
    )


def _omit_law(laws: tuple[int, ...], omitted: int) -> tuple[int, ...]:
    """Omit the law at the position `omitted` of a sum."""
    return (*laws[:omitted], *laws[omitted + 1 :])


def _cross_validate_sum(regression: Regression, laws: tuple[int, ...]) -> Structure:
    """Cross-validate the sum of these laws (indices)."""
    return Structure(laws, regression.cross_validate(regression.select_columns(laws)))
