"""Decides by the gain on held-out data which laws of a force balance are named. Called by `balances` and `actuator`.

No model of a real device reaches the sensors' noise. A law is therefore judged by its gain on held-out blocks over the
same sum of laws without it, with an interval from resampled blocks (Kunsch, Ann. Stat. 17:1217, 1989), against its best
rival, and by its share of the gain of all laws (a ceiling). Laws that cannot be distinguished are returned as a class.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from analysis.diagnosis.balance.blocks import Block
from analysis.diagnosis.balance.judged_law import DRY_FRICTIONS, JudgedLaw, family_of, force_ratio, special_cases
from analysis.diagnosis.balance.law import Law
from analysis.diagnosis.balance.regression import Regression, fit_all_laws
from analysis.diagnosis.balance.structures import (
    Structure,
    StructureSearch,
    choose_simplest_structure,
    count_parameters,
    fit_values,
)
from analysis.diagnosis.data.correlated_residuals import agrees_with_folds, bootstrap_draws, gain_with_bound
from analysis.diagnosis.settings import (
    BOOTSTRAP_DRAWS,
    FURTHER_LAW_GAIN,
    FURTHER_LAW_OF_ALL,
    LARGEST_CLASS,
    LARGEST_LAW_FORCE,
    LAW_OF_CEILING,
    LAW_OF_SIGNAL,
    LEAST_JUDGED_BLOCKS,
    NAMED_OF_CEILING,
    RIVAL_STAYS_BEHIND,
    SECOND_OF_FAMILY,
    STILL_SHARE,
)
from equalizer.plant.effect_vocabulary import EFFECTS_BY_NAME
from equalizer.signals.signal import FloatArray

SHAPE_FIX = "it acts like a named law, and may only correct the shape of that law"
SMALL_GAIN = ("its gain is too small to be named", "its gain varies too much from stretch to stretch of the recording")
BY_CONDITION = {"condition_dependent_friction", "condition_dependent_damping"}
"""Laws of one condition that may form a class, although other friction acts differently."""
SIMULATED_AS = {"drifting_friction": "coulomb_friction"}
"""Laws that have no simulation, and the law that is fitted in their place and forms a class with them."""


@dataclass(frozen=True, slots=True, eq=False)
class Balance:
    """Result of the force balance of one axis."""

    search: StructureSearch
    chosen: Structure
    laws: tuple[JudgedLaw, ...]
    """Laws of the chosen structure, the largest gain first."""
    further_laws: tuple[JudgedLaw, ...]
    """Other laws that would explain part of the residual of the chosen structure."""
    linear: float
    """Held-out error of mass, damping and stiffness alone, relative to the signal's rms."""
    error: float
    """Held-out error of the chosen structure, in the same unit."""
    ceiling: float
    """Held-out error of all laws together, in the same unit."""
    complete: bool
    tested: bool = True
    """Whether the held-out blocks, or the folds, contain enough motion for a test."""

    @property
    def named(self) -> tuple[JudgedLaw, ...]:
        """Those of `laws` that are to be named, in their order."""
        return tuple(law for law in self.laws if law.named)

    @property
    def linear_laws(self) -> tuple[Law, ...]:
        """Linear laws beside mass, damping and stiffness, of the base and of the chosen structure."""
        return (*self.search.regression.base_terms.laws, *(law.law for law in self.laws if law.law.linear))

    def without_names(self, reason: str) -> "Balance":
        """The balance with its named laws made candidates, for a reason in words."""
        return replace(self, laws=tuple(replace(law, objection=law.objection or reason) for law in self.laws))

    def error_of(self, laws: Sequence[int]) -> float:
        """Held-out error with these laws, relative to the signal's rms. laws: by number in the regression."""
        regression = self.search.regression
        return float(np.sqrt(_compute_errors(regression, laws).sum() / _sum_signal_power(regression)))


def judge_laws(search: StructureSearch) -> Balance:
    """The simplest structure of a search with each law tested on held-out blocks, and named or not."""
    regression = search.regression
    if not blocks_to_judge(regression):
        error = float(np.sqrt(search.linear.error / _sum_signal_power(regression)))
        return Balance(search, search.linear, (), (), error, error, error, search.complete, tested=False)
    balance = _judge_structure(search, choose_simplest_structure(search))
    if balance.named or not _shares_friction(regression, balance.chosen.laws):
        return balance
    # Two frictions share the error that either could explain alone, so that neither would seem necessary.
    single = tuple(s for s in search.ranked if not _shares_friction(regression, s.laws))
    best = min(single, key=lambda s: s.error, default=search.linear)
    simpler = _judge_structure(search, choose_simplest_structure(replace(search, ranked=single, best=best)))
    return simpler if simpler.named else balance


def _shares_friction(regression: Regression, laws: Sequence[int]) -> bool:
    """Whether two frictions along one channel are among these laws."""
    keys = [regression.laws[number].key for number in laws]
    channels = [channel for effect, channel in set(keys) if effect in family_of("coulomb_friction")]
    return len(channels) > len(set(channels))


def _judge_structure(search: StructureSearch, chosen: Structure) -> Balance:
    regression = search.regression
    errors = _compute_errors(regression, chosen.laws)
    linear = _compute_errors(regression, ())
    ceiling = _compute_ceiling(regression, errors)
    excess = max(float(linear.sum() - ceiling), 1e-6 * float(linear.sum()), 1e-300)
    coverage = 1 - float(errors.sum() - ceiling) / excess
    laws = [_judge_law(regression, chosen.laws, number, (errors, excess, coverage)) for number in chosen.laws]
    further_laws = _judge_further_laws(regression, search, chosen, (errors, excess))
    rms = [float(np.sqrt(error / _sum_signal_power(regression))) for error in (linear.sum(), errors.sum(), ceiling)]
    ordered = _name_once_per_family(sorted(laws, key=lambda law: -law.gain))
    return Balance(search, chosen, ordered, further_laws, rms[0], rms[1], rms[2], search.complete)


def _name_once_per_family(laws: Sequence[JudgedLaw]) -> tuple[JudgedLaw, ...]:
    """laws: the largest gain first. A second law of a family is named only if it explains most of the residual, because
    it may only correct the shape of the first."""
    checked: list[JudgedLaw] = []
    for law in laws:
        kin = [prior for prior in checked if prior.named and family_of(prior.law.effect) & {law.law.effect}]
        checked.append(replace(law, objection=SHAPE_FIX) if law.named and kin and law.gain < SECOND_OF_FAMILY else law)
    return tuple(checked)


def blocks_to_judge(regression: Regression) -> tuple[Block, ...]:
    """The blocks that laws are judged by: the held-out ones where the device moves in them; else the fit blocks, by
    cross-validation, where it moves in several; else none, because a single move cannot test a law."""
    if len(regression.test) >= LEAST_JUDGED_BLOCKS and held_out_moves(regression):
        return regression.test
    fit = _measure_speeds(regression, regression.fit)
    moves_often = float(fit.sum()) ** 2 >= LEAST_JUDGED_BLOCKS * float(fit @ fit)
    return regression.fit if moves_often or len(regression.test) < LEAST_JUDGED_BLOCKS else ()


def held_out_moves(regression: Regression) -> bool:
    """Whether the device moves in the held-out blocks, at `STILL_SHARE` of the fitted power; at least one is needed."""
    fit, test = (_measure_speeds(regression, blocks).mean() for blocks in (regression.fit, regression.test))
    return bool(test >= STILL_SHARE * fit)


def _measure_speeds(regression: Regression, blocks: Sequence[Block]) -> FloatArray:
    """(blocks,): mean square speed of the driven motion, relative to its scale."""
    speed = len(regression.motions[0].channels) + regression.base_terms.driven_channel
    return np.array([block.gram[speed, speed] / max(len(block.rows), 1) for block in blocks])


def _sum_signal_power(regression: Regression) -> float:
    return max(sum(block.signal for block in blocks_to_judge(regression) or regression.fit), 1e-300)


def _compute_errors(regression: Regression, laws: Sequence[int]) -> FloatArray:
    columns = regression.columns_of(laws)
    uses_held_out = blocks_to_judge(regression) is regression.test
    return regression.held_out_errors(columns) if uses_held_out else regression.cross_validated_errors(columns)


def _compute_ceiling(regression: Regression, chosen_errors: FloatArray) -> float:
    """Sum of squares with all laws together, but at most that of the chosen structure."""
    cross_validated, blocks = fit_all_laws(regression, range(regression.columns[0].shape[1]))
    error = float(blocks.sum()) if blocks_to_judge(regression) is regression.test else cross_validated
    return min(error, float(chosen_errors.sum()))


def _judge_law(
    regression: Regression, laws: Sequence[int], number: int, reference: tuple[FloatArray, float, float]
) -> JudgedLaw:
    full, excess, coverage = reference
    other_laws = tuple(index for index in laws if index != number)
    reduced = _compute_errors(regression, other_laws)
    gain, low = gain_with_bound(reduced, full)
    share = float((reduced - full).sum()) / excess
    law = regression.laws[number]
    values = dict(zip(laws, fit_values(regression, laws), strict=True))[number]
    equivalents, likely = _find_equivalents(regression, other_laws, number, (reduced, full))
    force_share = float(np.sqrt(max(float((reduced - full).sum()), 0.0) / _sum_signal_power(regression)))
    small = f"it explains {100 * force_share:.1f} % of the force, less than such recordings can confirm"
    objection = _find_objection(law, values, (gain, low, share, coverage), equivalents) or (
        small if force_share < LAW_OF_SIGNAL else ""
    )
    ratio = force_ratio(regression, laws, number)
    is_physical = values is not None and ratio <= LARGEST_LAW_FORCE
    if not objection and ratio > LARGEST_LAW_FORCE:
        objection = f"its force would be {ratio:.0f} times the recorded force, almost cancelled by other terms"
    stands_for = ""
    if not objection and law.effect in SIMULATED_AS:
        equivalents = (law.effect, *(effect for effect in equivalents if effect != SIMULATED_AS[law.effect]))
        stands_for, law = law.effect, replace(law, effect=SIMULATED_AS[law.effect])
    formula = None if law.formula is None or values is None else law.formula(values)
    return JudgedLaw(
        number, law, values or {}, gain, low, share, equivalents, likely, objection, stands_for, formula=formula,
        is_physical=is_physical,
        confirmed_by_folds=agrees_with_folds((reduced, full), _compute_fold_errors(regression, (other_laws, laws))),
    )  # fmt: skip


def _compute_fold_errors(regression: Regression, sums: Sequence[Sequence[int]]) -> list[FloatArray]:
    """Errors of each sum of laws on the folds, (blocks,); empty where laws are judged by the folds themselves."""
    if blocks_to_judge(regression) is not regression.test:
        return [np.zeros(0) for _ in sums]
    return [regression.cross_validated_errors(regression.columns_of(laws)) for laws in sums]


def _find_equivalents(
    regression: Regression, other_laws: tuple[int, ...], number: int, errors: tuple[FloatArray, FloatArray]
) -> tuple[tuple[str, ...], float]:
    """Effects with a similar error in a law's place, and the share of bootstrap draws in which none is better."""
    reduced, full = errors
    own_law = regression.laws[number]
    best_by_effect: dict[str, tuple[float, tuple[int, ...]]] = {}
    for place, law in enumerate(regression.laws):
        if law.effect == own_law.effect or law.linear or (own_law.linear and not law.linear):
            continue
        laws = (*other_laws, place)
        if any(regression.laws[k].key == law.key for k in other_laws) or fit_values(regression, laws)[-1] is None:
            continue
        error = float(regression.cross_validated_errors(regression.columns_of(laws)).sum())
        if law.effect not in best_by_effect or error < best_by_effect[law.effect][0]:
            best_by_effect[law.effect] = error, laws
    total_gain = float((reduced - full).sum())
    equivalents, draws = [], bootstrap_draws(len(full))
    is_first = np.ones(BOOTSTRAP_DRAWS, dtype=np.bool_)
    for effect, (_, laws) in best_by_effect.items():
        excess = _compute_errors(regression, laws) - full
        if own_law.effect not in special_cases(effect):
            is_first &= excess[draws].sum(axis=1) >= 0
        # Of two equally good laws, the simpler: a law of another kind with more parameters must have a smaller error.
        more_parameters = count_parameters(regression, laws[-1:]) > count_parameters(regression, [number])
        limit = 0.0 if more_parameters and effect not in family_of(own_law.effect) else RIVAL_STAYS_BEHIND * total_gain
        if float(excess.sum()) <= limit:
            equivalents.append((float(excess.sum()), effect))
    return tuple(effect for _, effect in sorted(equivalents)), float(is_first.mean())


def _find_objection(
    law: Law, values: dict[str, float] | None, numbers: tuple[float, float, float, float], equivalents: tuple[str, ...]
) -> str:
    """Reason not to name the law, as a sentence; empty where it is to be named."""
    gain, low, share, coverage = numbers
    if law.linear:
        return "it is a linear model of a higher order: part of the first model and no missing physics"
    if values is None:
        return "its parameters have signs that such physics cannot have"
    if low <= 0:
        return "its gain on held-out data is not larger than its variation between stretches of the recording"
    if share < LAW_OF_CEILING and gain < FURTHER_LAW_OF_ALL:
        return f"it explains {100 * share:.1f} % of what all laws together explain"
    if coverage < NAMED_OF_CEILING:
        return (
            f"even with it, {100 * (1 - coverage):.0f} % of what all laws together explain remain: the main cause is "
            "another"
        )
    family = family_of(law.effect) | (BY_CONDITION if law.effect in BY_CONDITION else set())
    of_other_family = [effect for effect in equivalents if effect not in family]
    rivals = [effect for effect in equivalents if law.effect not in special_cases(effect)]
    if of_other_family or (len(rivals) >= LARGEST_CLASS and not {law.effect, *rivals} <= DRY_FRICTIONS):
        return f"these data cannot distinguish it from {', '.join(of_other_family or equivalents)}"
    simulated = law.formula is not None or not {law.effect, SIMULATED_AS.get(law.effect)}.isdisjoint(EFFECTS_BY_NAME)
    return "" if simulated else "hapteq cannot simulate it yet"


def _judge_further_laws(
    regression: Regression, search: StructureSearch, chosen: Structure, reference: tuple[FloatArray, float]
) -> tuple[JudgedLaw, ...]:
    """The best further law of each effect beside the chosen structure, the largest gain first."""
    chosen_errors, excess = reference
    effects = {regression.laws[k].effect for k in chosen.laws}
    best: dict[str, tuple[float, int]] = {}
    for number, law in enumerate(regression.laws):
        if law.effect in effects or fit_values(regression, (*chosen.laws, number))[-1] is None:
            continue
        error = float(regression.cross_validated_errors(regression.columns_of((*chosen.laws, number))).sum())
        if law.effect not in best or error < best[law.effect][0]:
            best[law.effect] = error, number
    judged_laws = []
    for _, number in sorted(best.values())[:8]:
        laws = (*chosen.laws, number)
        errors = _compute_errors(regression, laws)
        gain, low = gain_with_bound(chosen_errors, errors)
        values, share = fit_values(regression, laws)[-1] or {}, float((chosen_errors - errors).sum()) / excess
        reason = (
            "it explains too little in addition to the named laws"
            if chosen.laws
            else SMALL_GAIN[gain > FURTHER_LAW_GAIN]
        )
        if gain > 0 and low > 0:
            law, physical = regression.laws[number], force_ratio(regression, laws, number) <= LARGEST_LAW_FORCE
            judged_laws.append(JudgedLaw(number, law, values, gain, low, share, (), 0.0, reason, is_physical=physical))
    return tuple(sorted(judged_laws, key=lambda judged_law: -judged_law.gain))
