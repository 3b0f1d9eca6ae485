"""Decide which laws of a force balance are named, by their errors on held-out data or else by cross-validation.

A law is a term of the balance, such as Coulomb friction. Models of real devices rarely reach the sensor noise: a test
against it would reject every law. A law is named if it decreases the squared error enough (its gain; interval by block
bootstrap: Kunsch, Ann. Stat. 17:1217, 1989), also relative to the decrease by all laws together, unless effects of
another family, or too many of its own, fit about as well (`_find_objection`). Begin at `judge_laws`.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from analysis.diagnosis.balance.judged_law import (
    FRICTIONS,
    INSIGNIFICANT_GAIN_OBJECTION,
    SIMULATED_AS,
    JudgedLaw,
    compute_force_ratio,
    find_family,
    list_special_cases,
    select_test_blocks,
)
from analysis.diagnosis.balance.laws.free_laws import FREE_LAWS
from analysis.diagnosis.balance.laws.law import Law
from analysis.diagnosis.balance.regression import Regression, fit_all_laws
from analysis.diagnosis.balance.structures import (
    Structure,
    StructureSearch,
    choose_simplest_structure,
    count_parameters,
    fit_values,
)
from analysis.diagnosis.data.correlated_residuals import bootstrap_gain, draw_bootstrap_blocks, is_confirmed_by_folds
from analysis.diagnosis.limits import (
    BOOTSTRAP_DRAWS,
    FREE_LAW_GAIN,
    FURTHER_LAW_GAIN,
    FURTHER_LAW_SHARE,
    LARGEST_CLASS,
    LARGEST_LAW_FORCE,
    LAW_FORCE_SHARE,
    LAW_REDUCTION_SHARE,
    NAMED_REDUCTION_SHARE,
    RIVAL_MARGIN,
    SECOND_OF_FAMILY_SHARE,
)
from equalizer.plant.effect_vocabulary import EFFECTS_BY_NAME
from equalizer.signals.signal import FloatArray

SHAPE_OBJECTION = "it acts like a named law, and may only correct the shape of that law"
"""Objection to a second law of a family."""
SMALL_GAIN_OBJECTION = "its gain is too small to be named"
VARYING_GAIN_OBJECTION = "its gain varies too much from stretch to stretch of the recording"
CONDITION_LAWS = {"condition_dependent_friction", "condition_dependent_damping"}
"""Laws that depend on a recorded condition. They may form a class, although they belong to different families."""
MOST_FURTHER_LAWS = 8
"""Largest number of effects outside the chosen structure that are tested. Chosen."""


@dataclass(frozen=True, slots=True, eq=False)
class Balance:
    """Result of the force balance of one axis: the chosen structure, with a test of each of its laws.

    Errors of mass, damping and stiffness alone, of the chosen structure, and of all laws together: rms on the test
    blocks, over the rms of the force about its mean; without a test, all three are the first, cross-validated."""

    search: StructureSearch
    chosen: Structure
    laws: tuple[JudgedLaw, ...]
    """Any law of the command, then those of the chosen structure, the largest gain first."""
    further_laws: tuple[JudgedLaw, ...]
    """Other laws that decrease the error of the chosen structure."""
    linear_error: float
    error: float
    all_laws_error: float
    complete: bool  # as `StructureSearch.complete`
    tested: bool = True  # whether the blocks allow a test

    @property
    def named(self) -> tuple[JudgedLaw, ...]:
        """Those of `laws` that are to be named, in their order."""
        return tuple(law for law in self.laws if law.named)

    @property
    def linear_laws(self) -> tuple[Law, ...]:
        """Linear laws in addition to mass, damping and stiffness, of the base terms and of the chosen structure."""
        return (*self.search.regression.base_terms.laws, *(law.law for law in self.laws if law.law.is_linear))

    def withdraw_names(self, reason: str) -> "Balance":
        """Copy the balance with no law named. reason: objection to each law that has none yet."""
        return replace(self, laws=tuple(replace(law, objection=law.objection or reason) for law in self.laws))

    def compute_error(self, law_indices: Sequence[int]) -> float:
        """Compute the error with laws (indices in the regression), as `error`."""
        regression = self.search.regression
        return float(np.sqrt(_compute_errors(regression, law_indices).sum() / _sum_power(regression)))


def judge_laws(search: StructureSearch) -> Balance:
    """Choose the simplest structure of a search, test each of its laws, and decide whether it is named."""
    regression = search.regression
    if not select_test_blocks(regression):
        error = float(np.sqrt(search.linear.error / _sum_power(regression)))
        return Balance(search, search.linear, (), (), error, error, error, search.complete, tested=False)
    balance = judge_structure(search, choose_simplest_structure(search))
    named_channels = {law.law.channel for law in balance.named if law.law.effect in find_family("coulomb_friction")}
    if _find_shared_channels(regression, balance.chosen.laws) <= named_channels:
        return balance
    # Either of two frictions could explain the same error, so that neither seems necessary: try structures with one.
    candidates = tuple(entry for entry in search.ranked if not _find_shared_channels(regression, entry.laws))
    best = min(candidates, key=lambda structure: structure.error, default=search.linear)
    simpler_balance = judge_structure(search, choose_simplest_structure(replace(search, ranked=candidates, best=best)))
    other_names = {law.law.key for law in balance.named if law.law.effect not in find_family("coulomb_friction")}
    has_more = len(simpler_balance.named) > len(balance.named)
    return simpler_balance if has_more and other_names <= {law.law.key for law in simpler_balance.named} else balance


def _find_shared_channels(regression: Regression, law_indices: Sequence[int]) -> set[int]:
    """Find the channels for which laws (indices in the regression) contain two effects of the family of friction."""
    law_keys = [regression.laws[law_index].key for law_index in law_indices]
    channels = [channel for effect, channel in set(law_keys) if effect in find_family("coulomb_friction")]
    return {channel for channel in channels if channels.count(channel) > 1}


def judge_structure(search: StructureSearch, chosen: Structure) -> Balance:
    """Test each law of `chosen`, and further laws. None is named where those that could be, with linear laws, explain
    less than `NAMED_REDUCTION_SHARE` of what all laws do. Shares are divided by at least 1e-6 of the linear error."""
    regression = search.regression
    errors, linear_errors = _compute_errors(regression, chosen.laws), _compute_errors(regression, ())
    all_laws_error = _compute_all_laws_error(regression, errors)
    decrease = max(float(linear_errors.sum() - all_laws_error), 1e-6 * float(linear_errors.sum()), 1e-300)
    judged = [_judge_law(regression, chosen.laws, index, (errors, decrease)) for index in chosen.laws]
    further_laws = _judge_further_laws(regression, chosen, (errors, decrease))
    linear_rms, chosen_rms, all_laws_rms = (
        float(np.sqrt(error / _sum_power(regression))) for error in (linear_errors.sum(), errors.sum(), all_laws_error)
    )
    laws = _name_once_per_family(sorted(judged, key=lambda law: -law.gain))
    balance = Balance(search, chosen, laws, further_laws, linear_rms, chosen_rms, all_laws_rms, search.complete)
    counted = [law.law_index for law in laws if law.named or law.law.is_linear or law.objection == SHAPE_OBJECTION]
    uncovered = float(_compute_errors(regression, counted).sum() - all_laws_error) / decrease
    reason = f"{100 * min(uncovered, 1.0):.0f} % of what all laws explain would remain: the main cause is another"
    return balance if uncovered <= 1 - NAMED_REDUCTION_SHARE else balance.withdraw_names(reason)


def _name_once_per_family(laws: Sequence[JudgedLaw]) -> tuple[JudgedLaw, ...]:
    """Object to further named laws of a family with a gain below `SECOND_OF_FAMILY_SHARE`. laws: the largest gain
    first."""
    results: list[JudgedLaw] = []
    for law in laws:
        similar = [judged for judged in results if judged.named and find_family(judged.law.effect) & {law.law.effect}]
        is_shape_correction = law.named and similar and law.gain < SECOND_OF_FAMILY_SHARE
        results.append(replace(law, objection=SHAPE_OBJECTION) if is_shape_correction else law)
    return tuple(results)


def _sum_power(regression: Regression) -> float:
    """Sum the squares of the force about its mean, at least 1e-300, over the test blocks, or else the fit blocks."""
    return max(sum(block.centred_power for block in select_test_blocks(regression) or regression.fit), 1e-300)


def _compute_errors(regression: Regression, law_indices: Sequence[int]) -> FloatArray:
    """Compute the sum of squared force errors with laws (indices in the regression) on each test block, (blocks,)."""
    columns, blocks = regression.select_columns(law_indices), select_test_blocks(regression)
    return regression.compute_test_errors(columns) if blocks is regression.test else regression.cross_validate(columns)


def _compute_all_laws_error(regression: Regression, chosen_errors: FloatArray) -> float:
    """Compute the sum of squared errors with all laws together, but at most that of the chosen structure."""
    cross_validated, test_errors = fit_all_laws(regression, range(regression.columns[0].shape[1]))
    error = float(test_errors.sum()) if select_test_blocks(regression) is regression.test else cross_validated
    return min(error, float(chosen_errors.sum()))


def _judge_law(
    regression: Regression, law_indices: Sequence[int], law_index: int, reference: tuple[FloatArray, float]
) -> JudgedLaw:
    """Test law `law_index` of `law_indices`. reference: squared errors (blocks,) with these; decrease by all laws."""
    full, decrease = reference
    other_laws = tuple(index for index in law_indices if index != law_index)
    reduced = _compute_errors(regression, other_laws)
    gain, gain_low = bootstrap_gain(reduced, full)
    share, law = float((reduced - full).sum()) / decrease, regression.laws[law_index]
    values = dict(zip(law_indices, fit_values(regression, law_indices), strict=True))[law_index]
    equivalents, probability = _find_equivalents(regression, other_laws, law_index, (reduced, full))
    force_share = float(np.sqrt(max(float((reduced - full).sum()), 0.0) / _sum_power(regression)))
    weakness = f"it explains {100 * force_share:.1f} % of the force, less than such recordings can confirm"
    objection = _find_objection(law, values, (gain, gain_low, share), equivalents) or (
        weakness if force_share < LAW_FORCE_SHARE else ""
    )
    ratio = compute_force_ratio(regression, law_indices, law_index)
    if not objection and ratio > LARGEST_LAW_FORCE:
        objection = f"its force would be {ratio:.0f} times the recorded force, almost cancelled by other terms"
    stands_for = ""
    if not objection and law.effect in SIMULATED_AS:
        equivalents = (law.effect, *(effect for effect in equivalents if effect != SIMULATED_AS[law.effect]))
        stands_for, law = law.effect, replace(law, effect=SIMULATED_AS[law.effect])
    return JudgedLaw(
        law_index, law, values or {}, gain, gain_low, share, equivalents, probability, objection, stands_for,
        formula=law.make_formula(values), is_physical=values is not None and ratio <= LARGEST_LAW_FORCE,
        confirmed_by_folds=is_confirmed_by_folds(
            (reduced, full), _compute_fold_errors(regression, (other_laws, law_indices))
        ),
    )  # fmt: skip


def _compute_fold_errors(regression: Regression, law_sets: Sequence[Sequence[int]]) -> list[FloatArray]:
    """Compute cross-validated errors (fit blocks,) per set of laws; of length 0 if these are the test blocks."""
    if select_test_blocks(regression) is not regression.test:
        return [np.zeros(0) for _ in law_sets]
    return [regression.cross_validate(regression.select_columns(law_indices)) for law_indices in law_sets]


def _find_equivalents(
    regression: Regression, other_laws: tuple[int, ...], law_index: int, errors: tuple[FloatArray, FloatArray]
) -> tuple[tuple[str, ...], float]:
    """Find `JudgedLaw.equivalents` and `.probability` of a law. errors: (blocks,), without and with the law."""
    reduced_errors, full_errors = errors
    tested_law = regression.laws[law_index]
    best_by_effect: dict[str, tuple[float, tuple[int, ...]]] = {}
    for index, law in enumerate(regression.laws):
        if law.effect == tested_law.effect or law.is_linear or (tested_law.is_linear and not law.is_linear):
            continue
        if law.effect in FREE_LAWS and tested_law.effect not in FREE_LAWS:
            continue  # a formula without a name is no reason to withdraw a name
        indices = (*other_laws, index)
        if any(regression.laws[k].key == law.key for k in other_laws) or fit_values(regression, indices)[-1] is None:
            continue
        error = float(regression.cross_validate(regression.select_columns(indices)).sum())
        if law.effect not in best_by_effect or error < best_by_effect[law.effect][0]:
            best_by_effect[law.effect] = error, indices
    decrease, draws = float((reduced_errors - full_errors).sum()), draw_bootstrap_blocks(len(full_errors))
    equivalents, is_best = [], np.ones(BOOTSTRAP_DRAWS, dtype=np.bool_)
    for effect, (_, indices) in best_by_effect.items():
        increases = _compute_errors(regression, indices) - full_errors
        if tested_law.effect not in list_special_cases(effect):
            is_best &= increases[draws].sum(axis=1) >= 0
        # Of two equally good laws, the simpler: another family's with more parameters must not have a larger error.
        has_more_parameters = count_parameters(regression, indices[-1:]) > count_parameters(regression, [law_index])
        limit = 0.0 if has_more_parameters and effect not in find_family(tested_law.effect) else RIVAL_MARGIN * decrease
        if tested_law.effect in FREE_LAWS:  # rivals leave at most 1 / (1 - FREE_LAW_GAIN) times its error
            limit = min(limit, FREE_LAW_GAIN / (1 - FREE_LAW_GAIN) * float(full_errors.sum()))
        if float(increases.sum()) <= limit:
            equivalents.append((float(increases.sum()), effect))
    return tuple(effect for _, effect in sorted(equivalents)), float(is_best.mean())


def _find_objection(
    law: Law, values: dict[str, float] | None, scores: tuple[float, float, float], equivalents: tuple[str, ...]
) -> str:
    """Find the reason not to name a law, empty if none. scores: gain, its lower bound and share."""
    gain, gain_low, share = scores
    if law.is_linear:
        return "it is a linear model of a higher order: part of the first model and no missing physics"
    if values is None:
        return "its parameters have signs that such physics cannot have"
    if gain_low <= 0:
        return INSIGNIFICANT_GAIN_OBJECTION
    if share < LAW_REDUCTION_SHARE and gain < FURTHER_LAW_SHARE:
        return f"it explains {100 * share:.1f} % of what all laws together explain"
    if law.effect in FREE_LAWS and gain < FREE_LAW_GAIN:
        return "a law that the catalogue lacks is named only where it halves the error on held-out data"
    family = find_family(law.effect) | (CONDITION_LAWS if law.effect in CONDITION_LAWS else set())
    other_families = [effect for effect in equivalents if effect not in family]
    rivals = [effect for effect in equivalents if law.effect not in list_special_cases(effect)]
    if other_families or (len(rivals) >= LARGEST_CLASS and not {law.effect, *rivals} <= FRICTIONS):
        rival_names = ("another formula" if name in FREE_LAWS else name for name in other_families or equivalents)
        return f"these data cannot distinguish it from {', '.join(dict.fromkeys(rival_names))}"
    is_simulated = law.formula is not None or not {law.effect, SIMULATED_AS.get(law.effect)}.isdisjoint(EFFECTS_BY_NAME)
    return "" if is_simulated else "hapteq cannot simulate it yet"


def _judge_further_laws(
    regression: Regression, chosen: Structure, reference: tuple[FloatArray, float]
) -> tuple[JudgedLaw, ...]:
    """Test the best law of each other effect: those with a significant gain, the largest first."""
    chosen_errors, decrease = reference
    chosen_effects = {regression.laws[index].effect for index in chosen.laws}
    best_by_effect: dict[str, tuple[float, int]] = {}
    for index, law in enumerate(regression.laws):
        if law.effect in chosen_effects or fit_values(regression, (*chosen.laws, index))[-1] is None:
            continue
        error = float(regression.cross_validate(regression.select_columns((*chosen.laws, index))).sum())
        if law.effect not in best_by_effect or error < best_by_effect[law.effect][0]:
            best_by_effect[law.effect] = error, index
    further_laws = []
    for _, index in sorted(best_by_effect.values())[:MOST_FURTHER_LAWS]:
        errors = _compute_errors(regression, law_indices := (*chosen.laws, index))
        gain, gain_low = bootstrap_gain(chosen_errors, errors)
        values, share = fit_values(regression, law_indices)[-1] or {}, float((chosen_errors - errors).sum()) / decrease
        objection = VARYING_GAIN_OBJECTION if gain > FURTHER_LAW_GAIN else SMALL_GAIN_OBJECTION
        if chosen.laws:
            objection = "it explains too little of the fitted data in addition to the other terms"
        if gain > 0 and gain_low > 0:
            law = regression.laws[index]
            further_laws.append(JudgedLaw(
                index, law, values, gain, gain_low, share, (), 0.0, objection, formula=law.make_formula(values),
                is_physical=compute_force_ratio(regression, law_indices, index) <= LARGEST_LAW_FORCE,
            ))  # fmt: skip
    return tuple(sorted(further_laws, key=lambda judged_law: -judged_law.gain))
