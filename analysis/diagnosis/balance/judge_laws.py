"""Decides which laws of a force balance are named, by their gain on held-out data.

No model of a real device reaches the sensors' noise, so that residuals are not judged in units of noise. A
law is judged by its gain on held-out blocks against the same sum of laws without it, with an interval from resampled
blocks (Kunsch, Ann. Stat. 17:1217, 1989), against the best rival in its place, and by its share of the gain of all laws
together (a ceiling). Laws that cannot be distinguished on these blocks are returned as a class.
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
    count_parameters,
    simplest_structure,
    values_of,
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

MENDS_SHAPE = "it acts like a named law, and may only correct the shape of that law"
NOT_ALONE = ("its gain is too small to be named", "its gain varies too much from stretch to stretch of the recording")
BY_CONDITION = {"condition_dependent_friction", "condition_dependent_damping"}
"""Laws of one condition that may form a class, although other friction acts differently."""
PLAYED_AS = {"drifting_friction": "coulomb_friction"}
"""Laws that have no simulation, and the law that is fitted in their place and forms a class with them."""


@dataclass(frozen=True, slots=True, eq=False)
class Balance:
    """Result of the force balance of one axis."""

    search: StructureSearch
    chosen: Structure
    laws: tuple[JudgedLaw, ...]
    """Laws of the chosen structure, the largest gain first."""
    others: tuple[JudgedLaw, ...]
    """Further laws that would explain part of the residual of the chosen structure."""
    linear: float
    """Held-out error of mass, damping and stiffness alone, relative to the signal's rms."""
    error: float
    """The same of the chosen structure."""
    ceiling: float
    """The same of all laws together."""
    complete: bool
    tested: bool = True
    """Whether the held-out blocks, or the folds, hold enough motion to test by."""

    @property
    def named(self) -> tuple[JudgedLaw, ...]:
        """Those of `laws` that are to be named, in their order."""
        return tuple(each for each in self.laws if each.named)

    @property
    def linear_laws(self) -> tuple[Law, ...]:
        """Linear laws beside mass, damping and stiffness, of the base and of the chosen structure."""
        return (*self.search.regression.beside.laws, *(each.law for each in self.laws if each.law.linear))

    def without_names(self, why_not: str) -> "Balance":
        """The balance with its named laws left as candidates."""
        return replace(self, laws=tuple(replace(each, why_not=each.why_not or why_not) for each in self.laws))

    def error_of(self, laws: Sequence[int]) -> float:
        """Held-out error with these laws, relative to the signal's rms. laws: by number in the regression."""
        regression = self.search.regression
        return float(np.sqrt(_held_out_errors(regression, laws).sum() / _signal_power(regression)))


def judge_laws(search: StructureSearch) -> Balance:
    """The simplest structure of a search with each law tested on held-out blocks, and named or not."""
    regression = search.regression
    if not blocks_to_judge(regression):
        alone = float(np.sqrt(search.linear.error / _signal_power(regression)))
        return Balance(search, search.linear, (), (), alone, alone, alone, search.complete, tested=False)
    judged = _judge_structure(search, simplest_structure(search))
    if judged.named or not _shares_friction(regression, judged.chosen.laws):
        return judged
    # Two frictions share the error that either could explain alone, so that neither would seem necessary.
    apart = tuple(each for each in search.ranked if not _shares_friction(regression, each.laws))
    best = min(apart, key=lambda each: each.error, default=search.linear)
    single = _judge_structure(search, simplest_structure(replace(search, ranked=apart, best=best)))
    return single if single.named else judged


def _shares_friction(regression: Regression, laws: Sequence[int]) -> bool:
    """Whether two frictions along one channel are among these laws."""
    keys = [regression.laws[number].key for number in laws]
    channels = [channel for effect, channel in set(keys) if effect in family_of("coulomb_friction")]
    return len(channels) > len(set(channels))


def _judge_structure(search: StructureSearch, chosen: Structure) -> Balance:
    regression = search.regression
    held = _held_out_errors(regression, chosen.laws)
    linear = _held_out_errors(regression, ())
    ceiling = _error_of_all_laws(regression, held)
    room = max(float(linear.sum() - ceiling), 1e-6 * float(linear.sum()), 1e-300)
    explained = 1 - float(held.sum() - ceiling) / room
    laws = [_judge_law(regression, chosen.laws, number, (held, room, explained)) for number in chosen.laws]
    others = _judge_further_laws(regression, search, chosen, (held, room))
    rms = [float(np.sqrt(error / _signal_power(regression))) for error in (linear.sum(), held.sum(), ceiling)]
    ordered = _name_once_per_family(sorted(laws, key=lambda each: -each.gain))
    return Balance(search, chosen, ordered, others, rms[0], rms[1], rms[2], search.complete)


def _name_once_per_family(laws: Sequence[JudgedLaw]) -> tuple[JudgedLaw, ...]:
    """laws: the largest gain first. A second law of a family must explain most of the residual to be named: if it acts
    like the first, it may only correct its shape."""
    found: list[JudgedLaw] = []
    for law in laws:
        mates = [other for other in found if other.named and family_of(other.law.effect) & {law.law.effect}]
        found.append(replace(law, why_not=MENDS_SHAPE) if law.named and mates and law.gain < SECOND_OF_FAMILY else law)
    return tuple(found)


def blocks_to_judge(regression: Regression) -> tuple[Block, ...]:
    """The blocks that laws are judged by: the held-out ones where the device moves in them; else the fit blocks, by
    cross-validation, where it moves in several; else none, because a single move cannot test a law."""
    if len(regression.test) >= LEAST_JUDGED_BLOCKS and held_out_moves(regression):
        return regression.test
    fit = _speeds(regression, regression.fit)
    several = float(fit.sum()) ** 2 >= LEAST_JUDGED_BLOCKS * float(fit @ fit)
    return regression.fit if several or len(regression.test) < LEAST_JUDGED_BLOCKS else ()


def held_out_moves(regression: Regression) -> bool:
    """Whether the driven motion goes on in the held-out blocks; there must be some."""
    fit, test = (_speeds(regression, blocks).mean() for blocks in (regression.fit, regression.test))
    return bool(test >= STILL_SHARE * fit)


def _speeds(regression: Regression, blocks: Sequence[Block]) -> FloatArray:
    """(blocks,): mean square speed of the driven motion, relative to its scale."""
    speed = len(regression.motions[0].channels) + regression.beside.own
    return np.array([block.gram[speed, speed] / max(len(block.rows), 1) for block in blocks])


def _signal_power(regression: Regression) -> float:
    return max(sum(block.signal for block in blocks_to_judge(regression) or regression.fit), 1e-300)


def _held_out_errors(regression: Regression, laws: Sequence[int]) -> FloatArray:
    columns = regression.columns_of(laws)
    held = blocks_to_judge(regression) is regression.test
    return regression.held_out_errors(columns) if held else regression.cross_validated_errors(columns)


def _error_of_all_laws(regression: Regression, held: FloatArray) -> float:
    """Sum of squares with all laws together, but at most that of the chosen structure."""
    crossed, blocks = fit_all_laws(regression, range(regression.columns[0].shape[1]))
    whole = float(blocks.sum()) if blocks_to_judge(regression) is regression.test else crossed
    return min(whole, float(held.sum()))


def _judge_law(
    regression: Regression, laws: Sequence[int], number: int, against: tuple[FloatArray, float, float]
) -> JudgedLaw:
    held, room, explained = against
    rest = tuple(each for each in laws if each != number)
    without = _held_out_errors(regression, rest)
    gain, low = gain_with_bound(without, held)
    share = float((without - held).sum()) / room
    law = regression.laws[number]
    values = dict(zip(laws, values_of(regression, laws), strict=True))[number]
    alike, likely = _indistinguishable_effects(regression, rest, number, (without, held))
    taken = float(np.sqrt(max(float((without - held).sum()), 0.0) / _signal_power(regression)))
    small = f"it explains {100 * taken:.1f} % of the force, less than such recordings can confirm"
    why_not = _why_not(law, values, (gain, low, share, explained), alike) or (small if taken < LAW_OF_SIGNAL else "")
    times = force_ratio(regression, laws, number)
    possible = values is not None and times <= LARGEST_LAW_FORCE
    if not why_not and times > LARGEST_LAW_FORCE:
        why_not = f"its force would be {times:.0f} times the recorded force, almost cancelled by other terms"
    chosen = ""
    if not why_not and law.effect in PLAYED_AS:
        alike = (law.effect, *(effect for effect in alike if effect != PLAYED_AS[law.effect]))
        chosen, law = law.effect, replace(law, effect=PLAYED_AS[law.effect])
    formula = None if law.formula is None or values is None else law.formula(values)
    return JudgedLaw(
        number, law, values or {}, gain, low, share, alike, likely, why_not, chosen, formula=formula, possible=possible,
        agreed=agrees_with_folds((without, held), _errors_of_folds(regression, (rest, laws))),
    )  # fmt: skip


def _errors_of_folds(regression: Regression, sums: Sequence[Sequence[int]]) -> list[FloatArray]:
    """Errors of each sum of laws on the folds, (blocks,); empty where laws are judged by the folds themselves."""
    if blocks_to_judge(regression) is not regression.test:
        return [np.zeros(0) for _ in sums]
    return [regression.cross_validated_errors(regression.columns_of(each)) for each in sums]


def _indistinguishable_effects(
    regression: Regression, rest: tuple[int, ...], number: int, errors: tuple[FloatArray, FloatArray]
) -> tuple[tuple[str, ...], float]:
    """Effects with a similar error in a law's place, and the share of bootstrap draws in which none is better."""
    without, held = errors
    own = regression.laws[number]
    found: dict[str, tuple[float, tuple[int, ...]]] = {}
    for place, law in enumerate(regression.laws):
        if law.effect == own.effect or law.linear or (own.linear and not law.linear):
            continue
        laws = (*rest, place)
        if any(regression.laws[k].key == law.key for k in rest) or values_of(regression, laws)[-1] is None:
            continue
        crossed = float(regression.cross_validated_errors(regression.columns_of(laws)).sum())
        if law.effect not in found or crossed < found[law.effect][0]:
            found[law.effect] = crossed, laws
    gained = float((without - held).sum())
    alike, drawn = [], bootstrap_draws(len(held))
    first = np.ones(BOOTSTRAP_DRAWS, dtype=np.bool_)
    for effect, (_, laws) in found.items():
        behind = _held_out_errors(regression, laws) - held
        if own.effect not in special_cases(effect):
            first &= behind[drawn].sum(axis=1) >= 0
        # Of two equally good laws, the plainer: a law of another kind with more parameters must have a smaller error.
        more = count_parameters(regression, laws[-1:]) > count_parameters(regression, [number])
        most = 0.0 if more and effect not in family_of(own.effect) else RIVAL_STAYS_BEHIND * gained
        if float(behind.sum()) <= most:
            alike.append((float(behind.sum()), effect))
    return tuple(effect for _, effect in sorted(alike)), float(first.mean())


def _why_not(
    law: Law, values: dict[str, float] | None, numbers: tuple[float, float, float, float], alike: tuple[str, ...]
) -> str:
    """Reason not to name the law, as a sentence; empty where it is to be named."""
    gain, low, share, explained = numbers
    if law.linear:
        return "it is a linear model of a higher order: part of the first model and no missing physics"
    if values is None:
        return "its parameters have signs that such physics cannot have"
    if low <= 0:
        return "its gain on held-out data is not larger than its variation between stretches of the recording"
    if share < LAW_OF_CEILING and gain < FURTHER_LAW_OF_ALL:
        return f"it explains {100 * share:.1f} % of what all laws together explain"
    if explained < NAMED_OF_CEILING:
        return (
            f"even with it, {100 * (1 - explained):.0f} % of what all laws together explain remain: the main cause is "
            "another"
        )
    family = family_of(law.effect) | (BY_CONDITION if law.effect in BY_CONDITION else set())
    of_other_family = [effect for effect in alike if effect not in family]
    others = [effect for effect in alike if law.effect not in special_cases(effect)]
    if of_other_family or (len(others) >= LARGEST_CLASS and not {law.effect, *others} <= DRY_FRICTIONS):
        return f"these data cannot distinguish it from {', '.join(of_other_family or alike)}"
    played = law.formula is not None or not {law.effect, PLAYED_AS.get(law.effect)}.isdisjoint(EFFECTS_BY_NAME)
    return "" if played else "hapteq cannot simulate it yet"


def _judge_further_laws(
    regression: Regression, search: StructureSearch, chosen: Structure, against: tuple[FloatArray, float]
) -> tuple[JudgedLaw, ...]:
    """The best further law of each effect beside the chosen structure, the largest gain first."""
    held, room = against
    effects = {regression.laws[k].effect for k in chosen.laws}
    best: dict[str, tuple[float, int]] = {}
    for number, law in enumerate(regression.laws):
        if law.effect in effects or values_of(regression, (*chosen.laws, number))[-1] is None:
            continue
        error = float(regression.cross_validated_errors(regression.columns_of((*chosen.laws, number))).sum())
        if law.effect not in best or error < best[law.effect][0]:
            best[law.effect] = error, number
    found = []
    for _, number in sorted(best.values())[:8]:
        laws = (*chosen.laws, number)
        errors = _held_out_errors(regression, laws)
        gain, low = gain_with_bound(held, errors)
        values, share = values_of(regression, laws)[-1] or {}, float((held - errors).sum()) / room
        why = (
            "it explains too little in addition to the named laws"
            if chosen.laws
            else NOT_ALONE[gain > FURTHER_LAW_GAIN]
        )
        if gain > 0 and low > 0:
            law, possible = regression.laws[number], force_ratio(regression, laws, number) <= LARGEST_LAW_FORCE
            found.append(JudgedLaw(number, law, values, gain, low, share, (), 0.0, why, possible=possible))
    return tuple(sorted(found, key=lambda each: -each.gain))
